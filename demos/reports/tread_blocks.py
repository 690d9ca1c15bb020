# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Tread blocks: stiff cords, and blocks in space
#
# The blocks of `tread_block.py` with cords along x, four times as stiff as the rubber (an orthotropic material), and
# two rows of three blocks in space on a rough surface, pressed and dragged in the same way.

# %%
import numpy as np
from harness.dragging import press_and_drag
from harness.pictures import area_and_friction, stick_slip_on_a_surface
from harness.rough_roads import rough_heights
from harness.scene import Scene

from forms import Anisotropic, Elasticity, Isotropic, Support
from geometry import Body, SmoothRoad, tread_block
from model import BodyOnRoad
from model.figures.contact_map import contact_map
from model.results.xdmf import on_body

scene = Scene("tread_blocks", "Rubber tread blocks on a rough road: cords along x, and blocks in space.")
scene.built("K").left_out("M", "C", "gmsh", "pyvista")
E, nu, mu = 5.0, 0.49, 0.8  # MPa, 1, 1
pressure, sliding = 0.3, 4.0  # mean pressure on the blocks (MPa), way of the road (mm)
rubber = Isotropic(E, nu)
corded = Anisotropic(rubber.matrix("3d") + np.diag([4 * E, 0, 0, 0, 0, 0]))


def road_through(places):
    """A smooth road through random heights at these places (m,) or (m, 2), its highest sample at 0."""
    heights = rough_heights(places, 0.15, (3.0, 25.0), power=0.8)
    return SmoothRoad.through(places, heights - heights.max())


@scene.assembly
def tread(dim, spacing, material, road, refinements=0):
    """The tread above the road, loaded by one unit of force on its platen."""
    size = ((3,), (8.0,), (2.0,)) if dim == 2 else ((3, 2), (8.0, 8.0), (2.0, 2.0))
    body = Body.from_grid(tread_block(*size, 6.0, 4.0, spacing), refinements)
    elasticity = Elasticity(body, material, mean_dilatation=True)
    held = {"x": 0.0} if dim == 2 else {"x": 0.0, "y": 0.0}
    load = elasticity.total_force("top", -np.eye(dim)[-1])
    system = elasticity.system(load, Support(body).platen("top").fix("top", **held))
    return BodyOnRoad(system, "bottom", road, friction=mu)


# %%
line = np.arange(-25.0, 30.0, 0.5)
profile = road_through(np.sort(np.random.default_rng(1).uniform(-25, 30, 300)))
surface = road_through(np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2))
steps, steps_3d = ((8, 16), (4, 6)) if scene.quick else ((20, 80), (10, 30))
spacing, refinements = (1.0, 0) if scene.quick else (0.5, 1)
plane, cords = (tread(2, spacing, material, profile) for material in (rubber, corded))
solid = tread(3, 2.0, rubber, surface, refinements)
paths = {
    "2-D": press_and_drag(scene, "2-D", plane, profile, pressure, sliding, steps),
    "2-D, cords along x": press_and_drag(scene, "2-D cords", cords, profile, pressure, sliding, steps),
    "3-D": press_and_drag(scene, "3-D", solid, surface, pressure, sliding, steps_3d),
}
scene.figure(area_and_friction(paths, mu), "area_and_friction")

# %%
path, begins = paths["3-D"], steps_3d[0] + steps_3d[1] // 3 - 1  # 1.33 mm
solution, count = path.solutions[begins], len(solid.elasticity.body.coordinates)
p, tau = solid.pressure(solution), -solid.traction(solution)[:, 0]
p_map, tau_map, status = (on_body(count, solid.nodes, values) for values in (p, tau, solution.status))
fields = {"pressure (MPa)": p_map, "traction along x (MPa)": tau_map}
title = f"Two rows of three blocks after {path.way[begins]:.2f} mm"
picture = contact_map(solid.elasticity.body, "bottom", fields, status, 15.0, title=title)
scene.figure(picture, "stick_and_slip_3d")
scene.figure(stick_slip_on_a_surface(solid, path, begins, surface, title), "on_the_road_3d")
solid.write(scene.out / "tread_3d.xdmf", path.solutions[-1])

# %%
scene.finish(
    path.solutions[-1],
    cycles=sum(s.cycles for s in path.solutions),
    solve_seconds=sum(s.seconds + s.setup_seconds for s in path.solutions),
)
