# %% [markdown]
# # A ring that really rolls
#
# **You will learn** why linear strain swells what turns, what finite strain mends, and what a time step then keeps and loses.
# **You need** the bouncing ring (`section_3_2_bouncing_ring.py`).
#
# Linear strain is blind to the difference between turning and stretching: a rotation by $\theta$ counts as a stretch by
# $\sqrt{1 + \theta^2}$. With $F = I + \nabla u$, $C = F^T F$ and an energy $\psi(C)$ a rotation costs nothing. A step of time
#
# $$ \tfrac{2}{\Delta t^2} M (u_1 - u_0 - \Delta t\, v_0) + \int \tfrac12 (F_0 + F_1)\, S : \nabla v = f + p_1 \tag{a} $$
#
# with the step stress $S$ of `forms/hyperelasticity.py` changes the energy by no more than the work of contact, $-p_1 g_0$
# where a node touches down and $-\mu p$ times slip, and leaves the spin of free flight alone.

# %%
import warnings

import numpy as np
from harness import wheels
from harness.driven_wheel import note_creepage
from harness.pictures import ring_outlines, way_over_time
from harness.scene import Scene

from forms import Elasticity, Isotropic
from model import BeyondLinear, EnergyMomentum, UnresolvedWaves

scene = Scene("rolling", "A ring that really rolls: linear and finite strain side by side.")
scene.built("M", "tangent").left_out("C", "gmsh", "pyvista")
warnings.simplefilter("ignore", UnresolvedWaves)  # said by the lesson on the bouncing ring
warnings.simplefilter("ignore", BeyondLinear)  # which is what we look at
MUS = (0.1,) if scene.quick else (0.0, 0.1, 0.5)
run = wheels.Runs(scene)  # takes steps, and keeps what all runs are judged by together

# %% [markdown]
# **The paper's ring, with linear and with finite strain**: `Elasticity` with `MovingBody` and `MassRedistribution`, or
# `Hyperelasticity` with `FiniteBody` and `EnergyMomentum`; histories, ledgers, checkpoints and series are the same.
# Friction makes the linear ring bounce 40 ms earlier; the ring of finite strain bounces 10 ms earlier with friction of 0.1
# (2.5 ms with steps of 1.25 ms). So the paper's earlier bounce is mostly swelling.

# %%
turns = wheels.note_paper_rings(scene, run, MUS)
pair = {at: ring for at, ring in turns.items() if "0.1" in at}
scene.figure(ring_outlines({at: ring.outline for at, ring in pair.items()}, 0.5), "outlines")
radius = {at: (ring.history["time"], ring.radius / 0.5) for at, ring in pair.items()}
scene.figure(way_over_time(radius, "mean outer radius over that at rest", 1.0), "swelling")

# %% [markdown]
# **From sliding to rolling.** A stiff ring of mass $m$ and inertia $I$ thrown along the road slides until friction has spun it up:
#
# $$ v = v_0 - \mu g t \quad\text{until}\quad t = \frac{v_0}{\mu g\, (1 + m R^2 / I)}, \qquad
#    v = \frac{v_0}{1 + I / (m R^2)} \quad\text{from then on.} \tag{b} $$

# %%
mesh, dt = ((96, 4), 0.002) if scene.quick else ((192, 6), 0.001)
scheme = EnergyMomentum(wheels.wheel(1e5, 0.1, mesh), dt)
lines = wheels.note_rolling(scene, scheme, mu=0.1, v0=2.0, end=0.85)
scene.figure(way_over_time(lines, "speed of the centre (m/s)"), "sliding_to_rolling")

# %% [markdown]
# **Down an incline** of 10 degrees it rolls with $g \sin\theta / (1 + I / (m R^2))$, or slides, with $g (\sin\theta - \mu \cos\theta)$,
# where $\mu < \tan\theta / (1 + m R^2 / I)$. **Thrown at 10 m/s without spin** it bounces, slides, and at last rolls; about the road's
# line under the centre the road has no moment, so a stiff ring ends at $v_0 / (1 + I / (m R^2))$, whatever the friction. The
# paper's is flattened where friction acts; this one is a thousand times stiffer, and rolls from 3.9 s on. **Under torque** a wheel creeps: Carter's
# $\xi = (\mu a / R) (1 - \sqrt{1 - Q / (\mu P)})$, for half planes, here at $Q = 0.75\, \mu P$.

# %%
wheels.note_incline(scene, run)
wheels.note_thrown(scene, run)
note_creepage(scene)

# %% [markdown]
# **What rolling must not cost.** A node that touches down has been pushed all the way there, so the step (a) loses $p_1 g_0$ with each, and the
# ring rolls with a resistance that is the algorithm's. `LosslessContact` gives it back, by a stress along $C_1 - C_0$.

# %%
wheels.note_losses(scene, run)
wheels.note_cost(scene)  # in time: each of Newton's iterations is a contact problem
run.note()
scene.finish(turns["finite, mu=0.1"].history)

# %% [markdown]
# **In ParaView**, open `ring.xdmf` and `ring_road.xdmf`, *Warp By Vector* on `displacement`, colour by `contact_pressure`, and play: it turns.
#
# ## Exercises
#
# 1. The linear ring has turned by $\theta$ with $\tan\theta$ as its displacements say. Does it swell by $1 / \cos\theta$?
# 2. What does a rotation by a radian cost the two materials?
# 3. St. Venant and Kirchhoff's material does not mind rotation either. Why is it not the default?

# %% tags=["hide-cell"]
# 1. Nearly: what is left is that it still vibrates.
print(f"{turns['linear, mu=0.1'].radius[90] / 0.5 * np.cos(turns['linear, mu=0.1'].angle[90]):.3f}")
# 2. Nothing the one, much the other.
elastic, X = scheme.body.elastic, scheme.body.coordinates
u = X @ np.array([[np.cos(1.0), np.sin(1.0)], [-np.sin(1.0), np.cos(1.0)]]) - X
stiffness = Elasticity(elastic.body, Isotropic(E=1e5, nu=0.3)).stiffness()
print(elastic.strain_energy(u), 0.5 * u.ravel() @ (stiffness @ u.ravel()), "J/m")
assert abs(elastic.strain_energy(u)) < 1e-9
# 3. Pressed flat it gives way: its stress vanishes with det F, and det F < 0 costs it little.
print([round((s**3 - s) / 2, 3) for s in (1, 0.8, 0.6, 0.4, 0.2)], "stress over E of a rod of such lengths")

# %% [markdown]
# **Further reading.** J. C. Simo, N. Tarnow, *The discrete energy-momentum method*, Z. angew. Math. Phys. 43 (1992) 757-792.
# O. Gonzalez, *Exact energy and momentum conserving algorithms for general models in nonlinear elasticity*, Comput. Methods
# Appl. Mech. Engrg. 190 (2000) 1763-1783.
