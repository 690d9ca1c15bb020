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
# and with linear shape functions $M \ddot u + C \dot u + K u = f$ (3). The traction of the road,
#
# $$ t = -p\, n + \tau, \tag{4} $$
#
# no form has to know: contact comes after assembly, node by node. So any symmetric $m$, $c$ and $k$ will do. Here a strip of
# foam ($\nu = 0$) on an elastic foundation is pressed on a road; its top sinks until foundation and strip carry $q$:
#
# $$ k(u, w) = \int_V \sigma(u) : \varepsilon(w) \, dV + \int_{top} \kappa\, u \cdot w \, dS, \qquad
#    p = \frac{q}{1 + \kappa H / E}. \tag{a} $$

# %%
import numpy as np
import ufl
from dolfinx import fem, mesh
from harness.pictures import lines_figure
from harness.readings import note_even, note_hill, read_patch
from harness.refusals import refusal
from harness.scene import Scene
from mpi4py import MPI

import forms
from geometry import Plane, RoundRoad
from model import BodyOnRoad, MassRedistribution, MovingBody, follow, integrate, solve

scene = Scene("section_2_1_own_forms", "A strip on an elastic foundation: own mesh, tags and forms.")
scene.built("K", "M").left_out("C", "gmsh")
L, H, E, rho, kappa, q = 60.0, 10.0, 5.0, 1e-9, 0.5, 0.2  # mm, mm, MPa, t/mm^3, N/mm^3, MPa
quads, TOP = mesh.CellType.quadrilateral, 5
domain = mesh.create_rectangle(MPI.COMM_SELF, [(-L / 2, 0.0), (L / 2, H)], [96, 16], quads)
bottom, top = (mesh.locate_entities_boundary(domain, 1, lambda x, y=y: np.isclose(x[1], y)) for y in (0.0, H))
tags = mesh.meshtags(domain, 1, np.sort(top), np.full(len(top), np.int32(TOP)))
V = fem.functionspace(domain, ("Lagrange", 1, (2,)))
load, on_top = fem.Constant(domain, (0.0, -q)), ufl.Measure("ds", domain, subdomain_data=tags)(TOP)
middle = fem.locate_dofs_geometrical(V, lambda x: np.isclose(x[0], 0.0) & np.isclose(x[1], H))
held = fem.dirichletbc(0.0, fem.locate_dofs_topological(V.sub(0), 0, middle), V.sub(0))


@scene.assembly
def strip(kappa=kappa, V=V, rho=0.0, update=None):
    u, w = ufl.TrialFunction(V), ufl.TestFunction(V)
    sigma = lambda u: E * ufl.sym(ufl.grad(u))  # noqa: E731
    k = ufl.inner(sigma(u), ufl.grad(w)) * ufl.dx + kappa * ufl.inner(u, w) * on_top
    m = rho * ufl.inner(u, w) * ufl.dx if rho else None
    return forms.assemble(k, ufl.inner(load, w) * on_top, [held], mass=m, update=update, stress=sigma)


system = strip(update=lambda part: setattr(load, "value", (0.0, -q * part)))
contact = BodyOnRoad(system, bottom, Plane())
solution, expected = solve(contact), q / (1 + kappa * H / E)
note_even(scene, contact, solution, expected)
uh = contact.function(solution)  # a dolfinx function in your own space
carried = fem.assemble_scalar(fem.form((kappa * uh[1] - load[1]) * on_top))
scene.result("force_balance_error", abs(solution.pressure_force.sum() / carried - 1), "1", 0.0, "equilibrium")

# A load path, with friction, on a round hill: follow asks update for the load of each step, with the same system.
hill = BodyOnRoad(system, bottom, RoundRoad(radius=40.0), friction=0.4)
*_, last = follow(hill, np.arange(1, 11) / 10)
tractions = note_hill(scene, hill, last)
scene.figure(lines_figure(tractions, "x (mm)", "stress (MPa)", "On a hill"), "pressure_on_the_hill")
hill.write(scene.out / "hill.xdmf", last)

# %% [markdown]
# **In time.** With `mass` the same door leads to time steps (`update` would be called with the time). From rest, a fifth more load makes
# the strip swing about its new state at rest: the mean of the pressure over many periods is (a) again.

# %%
load.value = 0.0, -1.2 * q
dt = H / 16 / np.sqrt(E / rho)  # a wave crosses a cell
scheme = MassRedistribution(MovingBody.from_contact(BodyOnRoad(strip(rho=rho), bottom, Plane())), dt)
swings = integrate(scheme, scheme.start(solution.displacement), 200 if scene.quick else 1000)
forces = [state.contact_force[:, 1].sum() / L for state in swings]
scene.result("mean_pressure_in_time", np.mean(forces), "MPa", 1.2 * expected, "eq. (a), over many periods")
times, levels = 1e3 * dt * np.arange(1, len(forces) + 1), {"at rest, eq. (a)": 1.2 * expected}
lines, title = {"computed": (times, forces)}, "A fifth more load, all at once"
scene.figure(lines_figure(lines, "t (ms)", "mean pressure (MPa)", title, levels), "pressure_in_time")
contact.problem.save(scene.out / "problem.npz", solution)
scene.finish(solution)

# %% [markdown]
# **In ParaView**, open `hill.xdmf` and `hill_road.xdmf`, *Warp By Vector* on `displacement`, and colour by `contact_pressure`.
#
# ## Exercises
#
# 1. Take the foundation away ($\kappa = 0$). What does the road carry?
# 2. Make the space of degree 2. What does `forms.assemble` say, and why is degree 1 asked for?
# 3. Let the foundation be softer towards the ends, $\kappa (1 - |x| / L)$. Where does the road bear more?
#
# **Further reading.** J. S. Dokken, *The FEniCSx tutorial*, https://jsdokken.com/dolfinx-tutorial. O. C. Zienkiewicz, R. L.
# Taylor, *The Finite Element Method*, 6th ed., Butterworth-Heinemann, 2005, chapters 2 and 3.

# %% tags=["hide-cell"]
load.value = 0.0, -q
# 1. The patch test: all of q, at every node.
plain = BodyOnRoad(strip(kappa=0.0), bottom, Plane())
assert abs(plain.pressure(solve(plain)) / q - 1).max() < 1e-9
# 2. Nodal forces of degree 2 are no pressures: those of the corners vanish or change their sign under a uniform load.
print(refusal(strip, kappa, fem.functionspace(domain, ("Lagrange", 2, (2,)))))
# 3. A form takes any coefficient; the road then bears more towards the ends.
uneven = BodyOnRoad(strip(kappa * (1 - abs(ufl.SpatialCoordinate(domain)[0]) / L)), bottom, Plane())
patch = read_patch(uneven, solve(uneven))
assert patch.p[0] > 1.1 * patch.p[48] > 1.1 * expected
