# %% [markdown]
# # Bring your own mesh
#
# **You will learn** how a mesh of another program comes in with its names, how to name what has none, and how to see that
# nothing was lost on the way. **You need** Hertz's theory (section 3.1.1). A steel ball of radius $R = 10$ mm is pressed on a plate with $F = 15$ kN. Its mesh is an Abaqus file: half of the lower
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
#
# ## The file, and its names
#
# `harness/abaqus_ball.py` stands for the preprocessor: nodes and elements with numbers of their own, a node set for the
# axis, a surface for what may touch, and a reference point that belongs to no element. What has no name is named by its
# position, as with dolfinx's `locate_entities_boundary`: here the flat top, where the load is put on.

# %%
import re

import numpy as np
from harness.abaqus_ball import write_ball
from harness.pictures import contact_zone
from harness.refusals import refusal
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, read_mesh
from model import BodyOnRoad, HertzSphere, pressure_figure, solve

scene = Scene("own_mesh", "A ball from an Abaqus file, pressed on a plate: Hertz from somebody else's mesh.")
scene.built("K").left_out("M", "C", "friction", "gmsh")
R, F, E, nu = 10.0, 15e3, 210e3, 0.3  # mm, N, MPa, 1
hertz, path = HertzSphere(F, R, E, nu), scene.out / "ball.inp"
write_ball(path, R, refinements=2 if scene.quick else 4)
body = Body.from_grid(read_mesh(path))
print("regions", {name: cells.size for name, cells in body.regions.items()})
print("boundaries", {name: len(rows) for name, rows in body.facets.items()})
body.mark("top", lambda x: x[1] > R - 1e-9)


@scene.assembly
def pressed(E=E):
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
scene.figure(contact_zone(contact, solution, centre=(1.0, 1.0), width=3.0), "ball")
contact.write(scene.out / "ball.xdmf", solution)
contact.problem.save(scene.out / "problem.npz", solution)
sheet = contact.reactions(solution)
print(sheet)
scene.result("contact_force", sheet.force["contact"][1], "N", F, "the load")
scene.finish(solution)

# %% [markdown]
# Did the load arrive? The sheet of all forces says so: loads, contact, what holds the axis, and in `ground` what a ring
# pulls inwards by itself. **In ParaView**, open `ball.xdmf`, and turn it with *Filters > Rotational Extrusion* to see the ball.
#
# ## Exercises
#
# 1. Ask for a boundary that the file does not have. What does the sentence tell you?
# 2. Lose every other node of the axis from the set, as a preprocessor may. What becomes of the set, and can it still be fixed?
# 3. Let the ball be of a material eight times as soft. By which factors do $a$ and $p_0$ change by (a), and how do they here?
#
# **Further reading.** K. L. Johnson, *Contact Mechanics*, Cambridge, 1985, section 4.2. N. Schlömer, *meshio* (software). C.
# Geuzaine, J.-F. Remacle, *Gmsh*, Int. J. Numer. Meth. Engng 79 (2009) 1309-1331.

# %% tags=["hide-cell"]
# 1. It lists the boundaries that there are.
print(refusal(body.nodes, "ball"))
# 2. A set that is no longer all nodes of some facets is no boundary, but a node set; supports take it all the same.
axis = re.search(r"nset=Axis\n((?: \d+\n)+)", path.read_text())[1]
lost = path.read_text().replace(axis, "".join(axis.splitlines(keepends=True)[::2]))
path.with_name("lost.inp").write_text(lost)
other = Body.from_grid(read_mesh(path.with_name("lost.inp")))
assert list(other.facets) == ["Ball"] and list(other.node_sets) == ["Axis"]
Support(other).fix("Axis", x=0.0)
# 3. a grows by 8^(1/3) = 2, and p0 falls to a quarter.
soft = pressed(E / 8)
assert abs(soft.pressure(solve(soft))[np.argsort(soft.points[:, 0])][1] / (p[order][1] / 4) - 1) < 0.1
