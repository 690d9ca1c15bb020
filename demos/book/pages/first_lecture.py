# %% [markdown]
# # First lecture: from `make demos` to your own scene
#
# Half an hour. **You need** a Linux machine with Python 3.12 or newer (or Debian 13, conda), a C compiler, and ParaView to look at results.
#
# ## 1. Run what is there (10 minutes, most of them installing)
#
#     make demos OPTIONS=--quick
#
# in the folder of this project sets up `.venv`, compiles the loop once (a minute in which little seems to happen), runs every lesson,
# and writes pictures, XDMF files and a `summary.json` for each into `results/NAME/`. One of them alone:
#
#     .venv/bin/python demos/section_3_1_1_normal_loading.py
#
# It prints what it found beside what it should have found. Look at `results/section_3_1_1_normal_loading/figure_4.png`.
#
# ## 2. Look at it in ParaView (5 minutes)
#
# 1. *File > Open* `results/section_3_1_1_normal_loading/friction.xdmf`; of the readers offered take **XDMF Reader**. *Apply*.
# 2. *Filters > Common > Warp By Vector*, Vectors `displacement`, Scale Factor 1. *Apply*.
# 3. Colour by `von_mises`, then `contact_pressure`, `gap`, `status` (0 free, 1 slips, 2 sticks).
# 4. Open `friction_road.xdmf` too: the road. In a series press the green arrow.
#
# The same by script: `pvpython demos/paraview/show_result.py results/section_3_1_1_normal_loading/friction.xdmf --colour von_mises --zoom 5`
#
# ```{figure} _static/paraview/cylinder.png
# :alt: ParaView: the lower part of a half cylinder on a road, coloured by von Mises stress, which is largest a little above the patch
# :width: 90%
#
# The half cylinder of section 3.1.1 in ParaView, coloured by `von_mises`.
# ```
#
# ## 3. Your own scene: a heel on a kerb (15 minutes)
#
# A scene is a mesh, a weak form, a road, and a call of `solve` or `follow`. Save the three cells below as `heel.py` in the folder of
# this project and run `.venv/bin/python heel.py`. But for `Body` the first two are plain gmsh, UFL and dolfinx.
#
# **Mesh.** A rubber heel with rounded edges, in mm, from gmsh. A mesh file of yours does as well: `read_mesh` takes what gmsh and meshio read.

# %%
import gmsh
import numpy as np
import ufl
from dolfinx import fem

import forms
from geometry import Body, Plane, RoundRoad, read_mesh
from model import BodyOnRoad, follow

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
heel = gmsh.model.occ.addRectangle(-15, 0, 0, 30, 10, roundedRadius=4)
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(2, [heel], name="rubber")
gmsh.model.mesh.setSize(gmsh.model.getEntities(0), 0.7)
gmsh.model.mesh.generate(2)
gmsh.write("heel.msh")
gmsh.finalize()

body = Body.from_grid(read_mesh("heel.msh")).mark("top", lambda x: x[1] > 10 - 1e-6)
body = body.mark("sole", lambda x: x[1] < 2.5)

# %% [markdown]
# **Weak form.** Plane strain, E = 5 MPa, nu = 0.4; a pressure on the top, which moves straight down. Any symmetric form of degree 1
# will do: add to `a` what your problem has (an elastic foundation in {doc}`section_2_1_own_forms`), and nothing else changes.

# %%
mesh, tags = body.mesh, body.facet_tags
sole = tags.find(body.names["sole"])  # the facets that may touch
V = fem.functionspace(mesh, ("Lagrange", 1, (2,)))
u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
E, nu = 5.0, 0.4


def sigma(u):
    """Hooke's law."""
    eps = ufl.sym(ufl.grad(u))
    return E / (1 + nu) * (eps + nu / (1 - 2 * nu) * ufl.tr(eps) * ufl.Identity(2))


pressure = fem.Constant(mesh, 0.0)  # MPa
a = ufl.inner(sigma(u), ufl.sym(ufl.grad(v))) * ufl.dx
L = -pressure * v[1] * ufl.Measure("ds", mesh, subdomain_data=tags)(body.names["top"])
top = fem.locate_dofs_topological(V.sub(0), 1, tags.find(body.names["top"]))
system = forms.assemble(a, L, bcs=[fem.dirichletbc(0.0, top, V.sub(0))], stress=sigma,
                        update=lambda part: setattr(pressure, "value", 0.1 * part))  # fmt: skip

# %% [markdown]
# **Road and contact.** A kerb of radius 30 mm that passes through the origin; friction 0.6; the load in five steps.

# %%
contact = BodyOnRoad(system, facets=sole, road=RoundRoad(radius=30.0), friction=0.6)
*_, solution = follow(contact, np.linspace(0.2, 1.0, 5))
contact.write("heel.xdmf", solution)

p, force = contact.pressure(solution), solution.contact_force.sum(axis=0)
touching, sticking = (np.count_nonzero(solution.status >= kind) for kind in (1, 2))
print(f"{touching} nodes touch, {sticking} of them stick")
print(f"largest pressure {p.max():.2f} MPa; the road carries {force[1]:.4f} N/mm, the load is {0.1 * 22:.4f}")
print(f"smallest gap {solution.gap.min()}, natural residual {solution.residual:.0e}")

# %% [markdown]
# Before you believe a scene, ask it three things: does the **force** of the road equal the load; is the **residual** small (the
# solver raises `NotConverged` if it is not below the tolerance); does the answer stay when you **halve the mesh width and the load steps**?
#
# ```{figure} _static/paraview/heel.png
# :alt: ParaView: a rounded rubber block pressed on the crest of a round road, coloured by contact pressure along its sole
# :width: 90%
#
# `pvpython demos/paraview/show_result.py heel.xdmf`
# ```
#
# ## 4. If it stumbles
#
# - *No friction, and nothing that holds the body in x*: `solve` refuses with a sentence that names the motion. Give a boundary condition or friction.
# - *Open with "Xdmf3"*: ParaView may crash or show nothing; take the reader called *XDMF Reader*.
# - *"BeyondLinear"* is a warning that strains or rotations are larger than linear strain can describe. The answer is that of the linear model.
# - *A mesh file without names*: `body.mark(name, where)` gives names by position; an unknown name is refused with those there are.
# - *"No module named 'model'"*: another Python than `.venv/bin/python`, or the folder has been moved since: run `.ci/setup` again.
# - *No screen*: `pvpython ... --picture out.png` needs one all the same: `xvfb-run -a pvpython ...` makes it.
# - *Nothing touches*: `status` is 0 everywhere. Is the road where you think it is? Open it beside the body.
#
# ## Exercises
#
# 1. Take the friction away. What must you add, and what becomes of the largest pressure?
# 2. Replace the kerb by `Plane()`. Where is the pressure largest now, and why there?
# 3. Pull the top by 2 mm to the right after pressing: make the value of the boundary condition a `Constant` that `update` sets.

# %% tags=["hide-cell"]
# 1. Nothing: the top is held in x. The pressure changes little, since the kerb is flat where it touches.
smooth = BodyOnRoad(system, facets=sole, road=RoundRoad(radius=30.0))
*_, free = follow(smooth, [1.0])
print(f"without friction {smooth.pressure(free).max():.3f} MPa, with friction {p.max():.3f} MPa")

# 2. At the ends of the flat part, where the rounding begins: the sides of the block push out and down there.
flat = BodyOnRoad(system, facets=sole, road=Plane(), friction=0.6)
*_, answer = follow(flat, [0.5, 1.0])
print(f"on a plane the largest pressure is at x = {flat.points[np.argmax(flat.pressure(answer)), 0]:.1f} mm")

# 3. A Constant in the boundary condition, moved by `update`:
shift = fem.Constant(mesh, 0.0)


def press_then_pull(part):
    """Press until part = 1, then pull."""
    pressure.value, shift.value = 0.1 * min(part, 1.0), 2.0 * max(part - 1.0, 0.0)


dragged = forms.assemble(
    a, L, bcs=[fem.dirichletbc(shift, top, V.sub(0))], stress=sigma, update=press_then_pull
)
pulled = BodyOnRoad(dragged, facets=sole, road=RoundRoad(radius=30.0), friction=0.6)
*_, end = follow(pulled, np.linspace(0.2, 2.0, 10))
pull = -end.contact_force[:, 0].sum() / end.contact_force[:, 1].sum()
print(
    f"pulled by 2 mm: friction is {pull:.2f} of the load, {np.count_nonzero(end.status == 2)} nodes still stick"
)
