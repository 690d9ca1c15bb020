# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Bring your own mesh
#
# **You will learn** how a mesh of another program comes in with its names, how to name what has none, and how to see that
# nothing was lost on the way. **You need** Hertz's theory (section 3.1.1).
#
# A steel ball of radius $R = 10$ mm is pressed on a plate with $F = 15$ kN. Its mesh is an Abaqus file: half of the lower
# half of the ball's section, to be turned about the axis. Hertz, for a sphere of plane strain modulus $E^* = E / (1 - \nu^2)$:
#
# $$ a^3 = \frac{3 F R}{4 E^*}, \qquad p_0 = \frac{3 F}{2 \pi a^2}. \tag{a} $$
#
# | file | read by | how to call it |
# |---|---|---|
# | .msh (2.2, 4.0, 4.1, text and binary), .med, .unv, .cgns, .bdf | gmsh | `read_mesh(path)` |
# | .inp of Abaqus: node sets, element sets, surfaces | this project | `read_mesh(path)` |
# | .vtk, .vtu, .xdmf and more; groups are the values of its integer arrays | meshio | `read_mesh(path)` |
# | .stl, .ply, .obj: a rigid obstacle | meshio, VTK | `SurfaceRoad.read(path, scale=25.4)` |
# | text of any form, units from its head | this project | `read_samples(path, unit="mm")` |
# | over thirty instruments; .crg | SurfaceTopography; pyopencrg | `read_topography(path, unit="mm")` |

# %%
import numpy as np
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder_nested, read_mesh
from model import BodyOnRoad, solve, von_mises
from model.closed_forms.hertz import HertzSphere
from model.figures.figures import body_picture, pressure_figure

scene = Scene("own_mesh", "A ball from an Abaqus file, pressed on a plate: Hertz from somebody else's mesh.")
scene.built("K")
scene.left_out("M", "C", "friction", "gmsh")
R, F, E, nu = 10.0, 15e3, 210e3, 0.3
hertz = HertzSphere(F, R, E, nu)
path = scene.out / "ball.inp"

# %% [markdown]
# ## The file
#
# Some preprocessor has written it: nodes and elements with numbers of its own, a node set for the axis, a surface for what
# may touch, and a reference point that belongs to no element.


# %%
def write_ball(path, refinements):
    whole = half_cylinder_nested(R, refinements)
    cells = whole.cells[whole.points[whole.cells, 0].mean(axis=1) > 0][:, [0, 1, 3, 2]]
    used, number = np.unique(cells, return_inverse=True)
    x, number = whole.points[used], number.reshape(cells.shape)
    on_arc = np.abs(np.hypot(x[:, 0], x[:, 1] - R) - R) < 1e-9
    lines = ["*Heading", " a ball, by somebody else's preprocessor", "*Node", " 1, 0., 99."]
    lines += [f" {10 * k + 10}, {a!r}, {b!r}" for k, (a, b) in enumerate(x.tolist())]
    lines += ["*Element, type=CAX4, elset=Steel"]
    lines += [f" {k + 1}, " + ", ".join(map(str, 10 * row + 10)) for k, row in enumerate(number)]
    axis = 10 * np.flatnonzero(x[:, 0] < 1e-9) + 10
    lines += ["*Nset, nset=Axis", *(f" {k}" for k in axis), "*Surface, name=Ball, type=ELEMENT"]
    sides = [
        (k + 1, s + 1) for k, row in enumerate(on_arc[number]) for s in range(4) if row[s] and row[s - 3]
    ]
    path.write_text("\n".join([*lines, *(f" {k}, S{s}" for k, s in sides)]) + "\n")


write_ball(path, 2 if scene.quick else 4)
body = Body.from_grid(read_mesh(path))
print("regions", {name: cells.size for name, cells in body.regions.items()})
print("boundaries", {name: len(rows) for name, rows in body.facets.items()})

# %% [markdown]
# The names are the file's. What has none is named by its position, as with dolfinx's `locate_entities_boundary`: here the
# flat top, where the load is put on.

# %%
body.mark("top", lambda x: x[1] > R - 1e-9)


@scene.assembly
def pressed():
    elasticity = Elasticity(body, {"Steel": Isotropic(E, nu)}, "axisymmetric")
    load = elasticity.total_force("top", (0.0, -F))
    return BodyOnRoad(elasticity.system(load, Support(body).fix("Axis", x=0.0)), "Ball", Plane())


contact = pressed()
solution = solve(contact)
r, p = contact.points[:, 0], contact.pressure(solution)
shape = np.sqrt(np.maximum(1 - (r / hertz.a) ** 2, 0))
p0 = contact.area @ (p * shape) / (contact.area @ shape**2)  # the node on the axis has no area to speak of
scene.result("p0", p0, "MPa", hertz.p0, "Hertz, eq. (a): his shape fitted to the pressure")
scene.result("last_in_contact", r[p > 0].max(), "mm", hertz.a, "Hertz, eq. (a)")
order = np.argsort(r)
exact, title = {"Hertz, eq. (a)": hertz.pressure}, "A ball from an Abaqus file"
scene.figure(pressure_figure(r[order], {"computed": p[order]}, exact, hertz.a, title), "pressure")
u = contact.displacement(solution)
mises = von_mises(contact.system.stress(u)), "von Mises stress (MPa)"
scene.figure(body_picture(body, u, *mises, centre=(1.0, 1.0), width=3.0, title="The contact zone"), "ball")
contact.write(scene.out / "ball.xdmf", solution)
contact.problem.save(scene.out / "problem.npz", solution)

# %% [markdown]
# Did the load arrive? The sheet of all forces says so: loads, contact, and what holds the axis. (`ground` is what a ring
# pulls inwards by itself.)

# %%
sheet = contact.reactions(solution)
print(sheet)
scene.result("contact_force", sheet.force["contact"][1], "N", F, "the load")

# %% [markdown]
# ## Exercises
#
# 1. Ask for a boundary that the file does not have. What does the sentence tell you?
# 2. Lose a node of the axis from the set, as a preprocessor may. What becomes of the set, and can it still be fixed?

# %% tags=["hide-cell"]
# 1. It lists the boundaries that there are.
try:
    body.nodes("ball")
except ValueError as error:
    print(error)
# 2. A set that is no longer all nodes of some facets is no boundary, but a node set; supports take it all the same.
text = path.read_text()
start = text.index("nset=Axis\n") + len("nset=Axis\n")
lost = text[:start] + text[start:].split("\n", 3)[3]
path.with_name("lost.inp").write_text(lost)
other = Body.from_grid(read_mesh(path.with_name("lost.inp")))
print("boundaries", list(other.facets), "node sets", list(other.node_sets))
Support(other).fix("Axis", x=0.0)

# %% [markdown]
# **Further reading.** K. L. Johnson, *Contact Mechanics*, Cambridge, 1985, section 4.2. N. Schlömer, *meshio* (software). C.
# Geuzaine, J.-F. Remacle, *Gmsh*, Int. J. Numer. Meth. Engng 79 (2009) 1309-1331.

# %%
scene.finish(solution)
