# %% [markdown]
# # A rod against a wall: why plain Newmark is not enough
#
# **You will learn** what exact contact does to a time integrator, and two cures. **You need** the wave equation, and
# equation (3) in time.
#
# A rod of length, density and modulus 1 is held at $x = 1$ and may touch a wall with its end $x = 0$. It starts at rest,
# evenly compressed, its end half a length away from the wall:
#
# $$ \ddot u = u'', \qquad u(1, t) = 0, \qquad u(0, t) \ge 0, \qquad u(x, 0) = \tfrac{1 - x}{2}. \tag{a} $$
#
# D'Alembert's waves give everything: the end touches for $1 < t < 2$, the wall presses with exactly 1/2 all that time,
# the energy is 1/8 for ever, and the motion repeats with period 3. In space, a strip of quadrilaterals one element high
# with $\nu = 0$ and $u_y = 0$ is the rod exactly. In time it is Newmark's method, $\beta = \tfrac14$, $\gamma = \tfrac12$:
#
# $$ \ddot u_{n+1} = \tfrac{1}{\beta \Delta t^2} (u_{n+1} - u_n - \Delta t\, \dot u_n)
#    - (\tfrac{1}{2 \beta} - 1) \ddot u_n, \tag{10} $$
# $$ \dot u_{n+1} = \tfrac{\gamma}{\beta \Delta t} (u_{n+1} - u_n) - (\tfrac{\gamma}{\beta} - 1) \dot u_n
#    - \Delta t (\tfrac{\gamma}{2 \beta} - 1) \ddot u_n. \tag{11} $$
#
# The energy then changes in a step by $\Delta E = \tfrac12 \sum_i (p_i^n + p_i^{n+1}) (g_i^{n+1} - g_i^n)$: a loss at impact, a
# gain at release. And a node held on the wall keeps its speed, the sign flipping every step. **HHT** and **generalised alpha**
# damp what oscillates. **Contact-stabilised Newmark** lets no speed carry a node into the wall, **mass redistribution** leaves
# the node at the wall no mass to bounce with: neither can gain energy. **Central differences** are explicit, on a lumped mass.

# %%
import warnings

import numpy as np
from harness.motion import note_impact, recorded, write_motion
from harness.pictures import panels_of_impacts
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, rectangle
from model import MovingBody, RodImpact, UnresolvedWaves
from model.dynamics.schemes import SCHEMES

scene = Scene("rod_impact", "A rod against a wall: what exact contact does to time integrators.")
scene.built("M", "K").left_out("C", "friction", "gmsh")
exact = RodImpact()
warnings.simplefilter("ignore", UnresolvedWaves)  # a wave with a sharp front is resolved by no dt


@scene.assembly
def strip(elements):
    body = Body.from_grid(rectangle(1.0, 1.0, elements, 1))
    support = Support(body).fix("right", x=0.0).fix("top", y=0.0).fix("bottom", y=0.0)
    elasticity, nothing = Elasticity(body, Isotropic(1.0, 0.0), "plane stress"), 0 * body.coordinates
    wall = Plane(normal=(1.0, 0.0))
    return elasticity, MovingBody.from_forms(elasticity, 1.0, nothing, wall, "left", support)


def impact(name, rod, dt, **keep):
    """Return the history of a run to t = 3."""
    scheme, x = SCHEMES[name](rod, dt), rod.coordinates[:, 0]
    u, end = np.column_stack([exact.displacement(x, 0.0), 0 * x]), {"end": int(np.argmin(x))}
    return recorded(scheme, 0 * u, round(3.0 / dt), end, displacement=u, **keep)


# With dt = 0.01 a wave crosses two of 200 elements in a step; central differences are stable for less than one.
elasticity, rod = strip(200)
runs = {name: impact(name, rod, 0.004 if "central" in name else 0.01) for name in SCHEMES}
states = []
impact("mass redistribution", rod, 0.01, on_state=states.append, save=scene.out / "problem.npz")
write_motion(scene.out / "rod.xdmf", elasticity, rod, "left", states[9::10])
for name, run in runs.items():
    note_impact(scene, name, run, exact)
    run.write(scene.out / f"history_{name.replace(' ', '_')}.csv")
identity = np.abs(runs["Newmark"]["gain"] - runs["Newmark"]["numerical"]).max() / exact.energy
scene.result("newmark_energy_identity_error", identity, "of 1/8", 0.0, "dE = 1/2 sum (p0 + p1)(g1 - g0)")
scene.figure(panels_of_impacts(runs, exact), "impact")
scene.finish(runs["Newmark"])

# %% [markdown]
# **In ParaView**, open `rod.xdmf`, *Warp By Vector*, colour by `stress`, component XX, and play: the front runs to and fro.
#
# ## Exercises
#
# 1. Halve dt three times on the same mesh. What becomes of the energy with Newmark, and with mass redistribution?
# 2. Halve h and dt = 2 h together, from 50 to 100 elements. With what order does the position of the end converge until
#    the release? (Over the whole rod it is 1: `reports/rod_orders.py`.)
# 3. Mass redistribution loses half a per cent of the energy. When?

# %% tags=["hide-cell"]
# 1. Newmark's kicks last shorter and weigh more; mass redistribution settles.
for name in ("Newmark", "mass redistribution"):
    halved = [impact(name, rod, 0.01 / 2**k) for k in (1, 2, 3)]
    print(name, *(f"{(run['kinetic'] + run['strain'])[-1] / exact.energy:.3f}" for run in halved))
# 2. With 1.5: the kink passes the end only at t = 1 and t = 2.
errors = []
for elements in (50, 100):
    run = impact("mass redistribution", strip(elements)[1], 2.0 / elements)
    off = (run["u_x(end)"] - exact.displacement(0.0, run["time"]))[run["time"] < 1.9]
    errors.append(np.sqrt(np.mean(off**2)))
assert 1.3 < np.log2(errors[0] / errors[1]) < 1.7
# 3. In the first step, where the end that has no mass any more comes into equilibrium at once.
energy = runs["mass redistribution"]["kinetic"] + runs["mass redistribution"]["strain"]
print("lost in the first step, and in all:", 1 - energy[[1, -1]] / exact.energy)

# %% [markdown]
# **Further reading.** D. Doyen, A. Ern, S. Piperno, *Time-integration schemes for the finite element dynamic Signorini
# problem*, SIAM J. Sci. Comput. 33 (2011) 223. P. Deuflhard, R. Krause, S. Ertel, *A contact-stabilized Newmark method*,
# Int. J. Numer. Meth. Engng 73 (2008) 1274. H. Khenous, P. Laborde, Y. Renard, *Mass redistribution method for finite
# element contact problems in elastodynamics*, Eur. J. Mech. A 27 (2008) 918.
