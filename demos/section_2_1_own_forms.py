# %% [markdown]
# # Section 2.1: bring your own mesh and forms
#
# **You will learn** to take a mesh, tags and weak forms of your own into contact: at rest, along a load path, in time.
# **You need** FEniCSx: functions, UFL, boundary conditions.
#
# Momentum $\nabla \cdot \sigma + b = \rho \ddot u$ (1), tested with $w$, is
#
# $$ \int_V w \cdot \rho \ddot u \, dV + \int_V \nabla w : \sigma \, dV = \int_V w \cdot b \, dV + \int_S w \cdot t \, dS
#    \tag{2} $$
#
# and with linear shape functions $M \ddot u + C \dot u + K u = f$ (3). The traction of the road splits into pressure
# and friction,
#
# $$ t = -p\, n + \tau, \tag{4} $$
#
# which no form has to know: contact comes after assembly, node by node. So any symmetric $m$, $c$ and $k$ will do. Here
# a strip of foam (nu = 0) on an elastic foundation is pressed against a road: $k$ has a term that no ready-made form has,
#
# $$ k(u, w) = \int_V \sigma(u) : \varepsilon(w) \, dV + \int_{top} \kappa\, u \cdot w \, dS. \tag{a} $$
#
# The mesh is of `dolfinx.mesh.create_rectangle`; those of `dolfinx.io.gmsh` and of XDMF files go the same way. Degree 1,
# as the paper prefers: the nodes that touch are those that carry the force. `load` is changed from step to step.
#
# ## At rest: on a plane
#
# Where the top sinks by $\delta$ the foundation carries $\kappa \delta$, the strip below $p = E \delta / H$. So everywhere
#
# $$ p = \frac{q}{1 + \kappa H / E}. \tag{b} $$

# %%
import numpy as np
from harness.pictures import lines_figure
from harness.refusals import refusal
from harness.scene import Scene

import forms
from geometry import Plane, RoundRoad
from model import BodyOnRoad, MassRedistribution, MovingBody, follow, solve

import ufl  # isort: skip
from dolfinx import fem, mesh  # isort: skip
from mpi4py import MPI  # isort: skip

scene = Scene("section_2_1_own_forms", "A strip on an elastic foundation: own mesh, tags and forms.")
scene.built("K", "M").left_out("C", "gmsh")
L, H, E, rho, kappa, q = 60.0, 10.0, 5.0, 1e-9, 0.5, 0.2  # mm, mm, MPa, t/mm^3, N/mm^3, MPa
BOTTOM, TOP = 2, 5
quads = mesh.CellType.quadrilateral
domain = mesh.create_rectangle(MPI.COMM_SELF, [(-L / 2, 0.0), (L / 2, H)], [96, 16], quads)
bottom, top = (mesh.locate_entities_boundary(domain, 1, lambda x, y=y: np.isclose(x[1], y)) for y in (0.0, H))
order = np.argsort(np.concatenate([bottom, top]))
values = np.repeat(np.int32([BOTTOM, TOP]), [len(bottom), len(top)])
tags = mesh.meshtags(domain, 1, np.concatenate([bottom, top])[order], values[order])
V = fem.functionspace(domain, ("Lagrange", 1, (2,)))
u, w = ufl.TrialFunction(V), ufl.TestFunction(V)
load = fem.Constant(domain, (0.0, 0.0))
ds = ufl.Measure("ds", domain, subdomain_data=tags)


def sigma(u):
    return E * ufl.sym(ufl.grad(u))


def k(u, w, kappa=kappa):
    return ufl.inner(sigma(u), ufl.sym(ufl.grad(w))) * ufl.dx + kappa * ufl.inner(u, w) * ds(TOP)


def press(part):
    load.value[:] = 0.0, -q * part


with scene.assembly:
    middle = fem.locate_dofs_geometrical(V, lambda x: np.isclose(x[0], 0.0) & np.isclose(x[1], H))
    held = fem.dirichletbc(np.float64(0.0), fem.locate_dofs_topological(V.sub(0), 0, middle), V.sub(0))
    pressing = ufl.inner(load, w) * ds(TOP)
    system = forms.assemble(k(u, w), pressing, [held], update=press, stress=sigma)

press(1.0)
contact = BodyOnRoad(system, tags.find(BOTTOM), Plane())
solution = solve(contact)
p, expected = contact.pressure(solution), q / (1 + kappa * H / E)
scene.result("pressure", p.mean(), "MPa", expected, "eq. (b)")
scene.result("largest_error_of_pressure", abs(p / expected - 1).max(), "1", 0.0, "eq. (b)")
scene.result("min_gap[plane]", solution.gap.min(), "mm", 0.0, "eq. (5)")
uh = contact.function(solution)  # a dolfinx function in your own space
carried = fem.assemble_scalar(fem.form((kappa * uh[1] - load[1]) * ds(TOP)))
scene.result("force_balance_error", abs(solution.pressure_force.sum() / carried - 1), "1", 0.0, "equilibrium")

# %% [markdown]
# ## A load path, with friction, on a round hill
#
# The same system; `follow` asks `update` for the load of each step. Nodes stick where the step before has left them.

# %%
hill = BodyOnRoad(system, tags.find(BOTTOM), RoundRoad(radius=40.0), friction=0.4)
path = list(follow(hill, np.arange(1, 11) / 10))
last, order = path[-1], np.argsort(hill.points[:, 0])
x, p, tau = hill.points[order, 0], hill.pressure(last)[order], hill.traction(last)[order, 0]
scene.result("nodes_in_contact[hill]", np.count_nonzero(last.status), "1")
scene.result("min_gap[hill]", last.gap.min(), "mm", 0.0, "eq. (5)")
scene.result("residual[hill]", last.residual, "1", 1e-10, "asked for", "at most")
lines, title = {"pressure": (x, p), "traction along x": (x, tau)}, "The strip pressed on a hill, ten steps"
scene.figure(lines_figure(lines, "x (mm)", "stress (MPa)", title), "pressure_on_the_hill")
hill.write(scene.out / "hill.xdmf", last)

# %% [markdown]
# ## In time: more load, all at once
#
# With `mass` the same door leads to time steps (`update` would be called with the time). From the state at rest, a fifth
# more load makes the strip swing about its new state at rest: the mean of the pressure over many periods is (b) again.

# %%
press(1.2)
swinging = forms.assemble(k(u, w), pressing, [held], mass=rho * ufl.inner(u, w) * ufl.dx)
moving = MovingBody.from_contact(BodyOnRoad(swinging, tags.find(BOTTOM), Plane()))
dt = H / 16 / np.sqrt(E / rho)  # a wave crosses a cell
scheme = MassRedistribution(moving, dt)
state, forces = scheme.start(solution.displacement), []
for _ in scene.progress(range(200 if scene.quick else 1000), "time steps"):
    state = scheme.step(state)
    forces.append(state.contact_force[:, 1].sum() / L)
scene.result("mean_pressure_in_time", np.mean(forces), "MPa", 1.2 * expected, "eq. (b), over many periods")
times, title = 1e3 * dt * np.arange(1, len(forces) + 1), "A fifth more load, all at once"
lines, level = {"computed": (times, forces)}, {"at rest, eq. (b)": 1.2 * expected}
scene.figure(lines_figure(lines, "t (ms)", "mean pressure (MPa)", title, level), "pressure_in_time")
contact.problem.save(scene.out / "problem.npz", solution)

# %% [markdown]
# **In ParaView**, open `hill.xdmf`, use *Warp By Vector* on `displacement`, and colour by `contact_pressure`.
#
# ## Exercises
#
# 1. Take the foundation away (kappa = 0). What does the road carry?
# 2. Make the space of degree 2. What does `forms.assemble` say, and why is degree 1 asked for?
# 3. Let the foundation be softer towards the ends, kappa (1 - |x| / L), and check the balance of forces.
#
# **Further reading.** J. S. Dokken, *The FEniCSx tutorial*, https://jsdokken.com/dolfinx-tutorial. O. C. Zienkiewicz, R. L.
# Taylor, *The Finite Element Method*, chapters 2 and 3.

# %% tags=["hide-cell"]
press(1.0)
# 1. The patch test: all of q, at every node.
plain = BodyOnRoad(forms.assemble(k(u, w, 0.0), pressing, [held]), tags.find(BOTTOM), Plane())
assert abs(plain.pressure(solve(plain)) / q - 1).max() < 1e-9
# 2. Nodal forces of degree 2 are no pressures: those of the corners vanish or change their sign under a uniform load.
V2 = fem.functionspace(domain, ("Lagrange", 2, (2,)))
print(refusal(forms.assemble, k(ufl.TrialFunction(V2), ufl.TestFunction(V2))))
# 3. What presses, less what the foundation carries, is what the road carries.
softer = kappa * (1 - abs(ufl.SpatialCoordinate(domain)[0]) / L)
uneven = BodyOnRoad(forms.assemble(k(u, w, softer), pressing, [held]), tags.find(BOTTOM), Plane())
answer = solve(uneven)
carried = fem.assemble_scalar(fem.form((softer * uneven.function(answer)[1] - load[1]) * ds(TOP)))
assert abs(answer.pressure_force.sum() / carried - 1) < 1e-9

# %%
scene.finish(solution)
