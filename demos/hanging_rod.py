# %% [markdown]
# # A rod: from springs to finite elements
#
# **You will learn** how a weak form becomes a matrix of springs, that contact does not care where the matrix came from, and
# how a closed form judges all of it. **You need** {doc}`node_and_spring`, and what a weak form is.
#
# A rod of rubber, $L$ long, hangs from a ceiling, its lower end a gap $g_0$ above a road. Its weight stretches it. With $y$ and $u$
# upwards from the lower end, equilibrium and Hooke's law, tested with a $v$ that is 0 at the ceiling, read
#
# $$ \sigma' = \rho g, \quad \sigma = E u' \qquad\Longrightarrow\qquad
#    \int_0^L E u' v' \, dy = -\int_0^L \rho g\, v \, dy + p\, v(0), \tag{2} $$
#
# where $p \ge 0$ is the pressure of the road. Integrated twice, with $u(L) = 0$ and $u(0) \ge -g_0$,
#
# $$ u = \frac{p (L - y) - \tfrac12 \rho g (L^2 - y^2)}{E}, \qquad \sigma = \rho g\, y - p, \qquad
#    p = \max\Big( \frac{\rho g L}{2} - \frac{E g_0}{L},\ 0 \Big): \tag{a} $$
#
# ceiling and road share the weight, half of it each if there was no gap. **By hand:** hat functions in (2) make a spring $E/h$ of
# each of $n$ elements of length $h$, and $-\rho g h$ the load of a node, half of it at the end: the matrix and the load of (3),
# $K u = b + p$, in four lines. The loop has one node to look after.

# %%
import numpy as np
import ufl
from dolfinx import fem
from harness.pictures import rod_that_hangs
from harness.rods import hanging_rod
from harness.scene import Scene

import forms
from geometry import Body, Plane, rectangle
from model import BodyOnRoad, solve

scene = Scene("hanging_rod", "A rubber rod that its weight stretches down to a road: by hand, and from UFL.")
scene.built("K").left_out("M", "C", "friction", "gmsh")
L, E, weight, gap, n = 1.0, 1e6, 1200 * 9.81, 2e-3, 10  # m, Pa, N/m^3, m, elements


def by_hand(g0):
    h = L / n
    K = E / h * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))  # without the node at the ceiling
    K[0, 0] = E / h  # the end has a spring on one side only
    b = -weight * h * np.r_[0.5, np.ones(n - 1)]
    u = np.linalg.solve(K, b)  # suppose the end is free
    if u[0] < -g0:  # it is not: put it on the road
        u[0] = -g0
        u[1:] = np.linalg.solve(K[1:, 1:], b[1:] - K[1:, 0] * u[0])
    return np.linspace(0, L, n + 1), np.append(u, 0.0), K[0] @ u - b[0]  # heights, u, pressure


# %% [markdown]
# **From UFL.** The same rod as a strip of $\nu = 0$ in the plane: a mesh of dolfinx, the two sides of (2) as one writes them, and
# the facets that may touch. `forms.assemble` gives (3), `BodyOnRoad` gaps and normals, `solve` runs the loop.


# %%
@scene.assembly
def strip(g0, lowered=0.0, sigma=lambda u: E * ufl.sym(ufl.grad(u))):
    body = Body.from_grid(rectangle(0.1, L, 1, n))
    V = fem.functionspace(body.mesh, ("Lagrange", 1, (2,)))
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    top, bottom = (body.facet_tags.find(body.names[name]) for name in ("top", "bottom"))
    held = fem.dirichletbc(np.array([0.0, -lowered]), fem.locate_dofs_topological(V, 1, top), V)
    a, b = ufl.inner(sigma(u), ufl.grad(v)) * ufl.dx, -weight * v[1] * ufl.dx
    return BodyOnRoad(forms.assemble(a, b, [held], stress=sigma), bottom, Plane((0.0, -g0)))


y, u, p = by_hand(gap)
exact, sigma, pressure = hanging_rod(y, L, E, weight, gap)
contact = strip(gap)
solution = solve(contact)
heights, moved = contact.system.points[:, 1], contact.displacement(solution)[:, 1]
errors = u - exact, moved - hanging_rod(heights, L, E, weight, gap)[0]
for way, force, error in zip(("by hand", "UFL"), (p, contact.pressure(solution).mean()), errors):
    scene.result(f"pressure[{way}]", force, "Pa", pressure, "eq. (a)")
    scene.result(f"largest_error_of_u[{way}]", np.abs(error).max() / gap, "g0", 0.0, "eq. (a), at the nodes")
scene.result("min_gap", solution.gap.min(), "m", 0.0, "eq. (5)")
gaps, stress = np.linspace(0, 8e-3, 41), E * np.diff(u) / np.diff(y)
forces = np.array([[by_hand(g)[2], hanging_rod(0.0, L, E, weight, g)[2]] for g in gaps])
scene.figure(rod_that_hangs(y, (u, stress), (exact, sigma), gaps, forces), "rod")
contact.write(scene.out / "rod.xdmf", solution)
contact.problem.save(scene.out / "problem.npz", solution)
scene.finish(solution)

# %% [markdown]
# **In ParaView**, open `rod.xdmf` and `rod_road.xdmf`, *Warp By Vector* on `displacement`, and colour by `stress`, component YY: it
# changes its sign where the road's share of the weight ends.
#
# ## Exercises
#
# 1. At which gap does the rod just touch? And at which height is it neither stretched nor compressed?
# 2. By how much must the ceiling come down until the whole rod is compressed?
# 3. At the nodes $u$ is right to rounding on any mesh. Is the stress? Where in an element is it?
#
# **Further reading.** J. S. Dokken, *The FEniCSx tutorial*, https://jsdokken.com/dolfinx-tutorial. N. Kikuchi, J. T. Oden, *Contact
# Problems in Elasticity*, SIAM, 1988, chapters 1 and 2. G. Strang, G. Fix, *An Analysis of the Finite Element Method*, 1973, for 3.

# %% tags=["hide-cell"]
# 1. g0 = rho g L^2 / (2 E); and by (a) at y = p / (rho g), where the road has borne what hangs below.
touches = weight * L**2 / (2 * E)
assert abs(by_hand(1.001 * touches)[2]) < 1e-9 < 1 < by_hand(0.999 * touches)[2] and 0 < p / weight < L
# 2. (a) with u(L) = -delta: p = rho g L / 2 + E (delta - g0) / L = rho g L. The ceiling then pushes with nothing.
lowered = strip(gap, gap + touches)
assert np.isclose(lowered.pressure(solve(lowered)).mean(), weight * L)
# 3. It is constant in each element, and right in the middle: half a step, rho g h / 2, off at the ends.
assert np.allclose(stress, (sigma[1:] + sigma[:-1]) / 2)
