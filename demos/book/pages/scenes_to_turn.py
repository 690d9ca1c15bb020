# %% [markdown]
# # Scenes to turn, and films
#
# Drag with the mouse to turn a scene, roll the wheel to come nearer. Each is one file with its viewer in it; the grey
# surface is the road.

# %% tags=["remove-cell"]
import sys
import warnings
from io import BytesIO
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pyvista
from IPython.display import HTML, IFrame, display
from matplotlib.figure import Figure

import model
from forms import Elasticity, Isotropic, Support
from geometry import Body, ExtrudedRoad, LinearRoad, Plane, box, half_ball, ring
from model import BeyondLinear, BodyOnRoad, ContactStabilised, MovingBody, integrate, solve
from model.results.road_surface import road_surface

sys.path.append(str(Path(model.__file__).parents[1] / "demos" / "book"))
from turnable import write_page

warnings.simplefilter("ignore", BeyondLinear)  # the page says it
OUT = Path("book")
OUT.mkdir(exist_ok=True)


def grid_of(contact, solution):
    """Return the warped mesh with pressure and status, for pyvista."""
    from dolfinx.plot import vtk_mesh

    nodes, cells = contact.fields(solution)
    grid = pyvista.UnstructuredGrid(*vtk_mesh(contact.mesh))
    grid.points += nodes["displacement"]
    grid["contact pressure (MPa)"] = nodes["contact_pressure"]
    grid["von Mises stress (MPa)"] = cells["von_mises"]
    return grid


def show(name, contact, solution, colour, camera, words):
    """Write a scene, and show it on this page."""
    plotter = pyvista.Plotter(off_screen=True, window_size=(900, 560))
    plotter.background_color = "white"
    grid = grid_of(contact, solution)
    plotter.add_mesh(
        grid,
        scalars=colour,
        cmap="viridis",
        show_edges=True,
        edge_color="grey",
        scalar_bar_args={"color": "black"},
    )
    road = road_surface(contact.road, np.asarray(grid.points), cells=24)
    plotter.add_mesh(pyvista.PolyData.from_regular_faces(road.points, road.facets), color="grey", opacity=0.4)
    plotter.camera_position = camera
    plotter.reset_camera()
    write_page(plotter, OUT / f"{name}.html")
    plotter.close()
    address = f"_static/scenes_to_turn/{name}.html"
    display(IFrame(address, "100%", 460, extras=[f'title="{words}"', 'class="scene"']))


# %% [markdown]
# ## A ball on a plane
#
# The front half is cut away. Under the surface, a little below the patch, the stress is largest: that is where bearings begin
# to fail. (E = 210 GPa, R = 10 mm, 15 kN, shown as it is, not magnified.)

# %% tags=["remove-input", "remove-stderr"]
elasticity = Elasticity(Body.from_grid(half_ball(10.0, "half"), 1), Isotropic(210e3, 0.3))
support = Support(elasticity.body).platen("top").fix("y0", y=0.0).fix("top", x=0.0)
system = elasticity.system(elasticity.total_force("top", (0.0, 0.0, -7.5e3)), support)
ball = BodyOnRoad(system, "sphere", Plane((0, 0, 0), (0, 0, 1)), reach=2.0)
answer = solve(ball.problem)
show(
    "ball",
    ball,
    answer,
    "von Mises stress (MPa)",
    [(0, -30, 8), (0, 0, 3), (0, 0, 1)],
    "A half ball pressed on a plane, coloured by stress",
)

# %% [markdown]
# ## A block of rubber on waves
#
# Look from below, through the road: it touches on the crests only. (E = 5 MPa, nu = 0.4, 0.2 MPa from above. The largest strains are 10 %,
# at the edges: more than linear strain, which this is, should be asked for.)

# %% tags=["remove-input", "remove-stderr"]
x = np.linspace(-20, 40, 241)
waves = ExtrudedRoad(LinearRoad(x, 0.25 * np.cos(2 * np.pi * x / 10) - 0.25))
elasticity = Elasticity(Body.from_grid(box(20.0, 10.0, 6.0, 32, 10, 8)), Isotropic(5.0, 0.4))
support = Support(elasticity.body).platen("top").fix("top", x=0.0, y=0.0)
system = elasticity.system(elasticity.total_force("top", (0.0, 0.0, -0.2 * 200)), support)
block = BodyOnRoad(system, "bottom", waves, friction=0.5)
answer = solve(block)
show(
    "block",
    block,
    answer,
    "contact pressure (MPa)",
    [(55, -60, -14), (10, 5, 2), (0, 0, 1)],
    "A rubber block on a wavy road, coloured by contact pressure, from below",
)

# %% [markdown]
# ## A film: the ring of section 3.2
#
# Launched at 10 m/s along a road with friction 0.1. Linear strain is the paper's model: with the spin that the road gives it, the
# ring swells, which a real one does not.

# %% tags=["remove-input", "remove-stderr"]
body = Body.from_grid(ring(0.5, 0.2, 64, 4, lowest=(0.0, 0.5)))
elasticity = Elasticity(body, Isotropic(1000.0, 0.3))
weight = elasticity.body_force((0.0, -9.81))
moving = MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "outer", friction=0.1)
scheme = ContactStabilised(moving, 0.005)
velocity = np.zeros_like(body.coordinates)
velocity[:, 0] = 10.0
frames = []
corners = body.cells[:, [0, 1, 3, 2, 0]]
for state in integrate(scheme, scheme.start(velocity=velocity), 200):
    if state.step % 4:
        continue
    at = body.coordinates + state.displacement
    figure = Figure(figsize=(5.6, 3.6), dpi=90, layout="constrained")
    axes = figure.subplots()
    axes.plot(*at[corners].transpose(2, 1, 0), color="0.4", lw=0.5)
    axes.axhline(0, color="k", lw=2)
    touching = moving.contact_nodes[state.status > 0]
    axes.plot(*at[touching].T, "ko", ms=4)
    axes.set(
        xlim=(at[:, 0].mean() - 1, at[:, 0].mean() + 1),
        ylim=(-0.1, 1.2),
        aspect="equal",
        xlabel="x (m)",
        ylabel="y (m)",
        title=f"t = {state.time:.2f} s",
    )
    file = BytesIO()
    figure.savefig(file, format="png")
    frames.append(imageio.imread(file.getvalue())[..., :3])
imageio.imwrite(OUT / "ring.gif", frames, duration=80, loop=0)
display(
    HTML(
        '<img src="_static/scenes_to_turn/ring.gif" alt="Film of an elastic ring that falls on a road, is flattened, '
        'bounces and begins to spin; dots mark the nodes that touch">'
    )
)
