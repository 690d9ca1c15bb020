# %% [markdown]
# # A tread block on a rough road
#
# **You will learn** to read a road from a file, to follow a load path over it, and why the real contact area is not the
# nominal one. **You need** section 3.1.2. Rubber blocks with grooves between them are pressed on a rough road by a rigid platen, and the road is pulled away below
# them. At each step the displacement and the forces satisfy $K u = b + f$ and
#
# $$ g(x + u) \ge 0, \qquad p \ge 0, \qquad p\,g = 0, \qquad |\tau| \le \mu p, \tag{5, 6, 7} $$
#
# with $g$ the distance to the nearest point of the road where it is at that time, $p$ along its normal there and
# $\tau$ across it. A node sticks to the road, and moves with it, until that takes more than $\mu p$. On a curved road each
# step is solved in rounds, on planes that follow the nodes, until every node that touches lies on the road itself.
#
# Rubber hardly changes its volume ($\nu = 0.49$), and bilinear cells, asked not to at every point, lock. Here each cell has
# one dilatation, its mean, which halves the number of constraints:
#
# $$ \bar\varepsilon(u) = \varepsilon(u) + \tfrac1d \big( \langle \nabla \cdot u \rangle - \nabla \cdot u \big) I. \tag{a} $$

# %%
from dataclasses import replace

import numpy as np
from harness.dragging import press_and_drag
from harness.pictures import area_and_friction, stick_slip_along_the_road
from harness.rough_roads import rough_heights, write_profile
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, SmoothRoad, read_samples, tread_block
from model import BodyOnRoad, solve

scene = Scene("tread_block", "A rubber tread block pressed on a rough road and dragged over it.")
scene.built("K").left_out("M", "C", "gmsh", "pyvista")
E, nu, mu = 5.0, 0.49, 0.8  # MPa, 1, 1
pressure, sliding = 0.3, 4.0  # mean pressure on the blocks (MPa), way of the road (mm)
steps, spacing = ((8, 16), 1.0) if scene.quick else ((20, 80), 0.5)  # pressing and dragging; mm


@scene.assembly
def tread(road):
    body = Body.from_grid(
        tread_block((3,), (8.0,), (2.0,), 6.0, 4.0, spacing)
    )  # 3 blocks of 8 mm, grooves 2 x 6 mm
    elasticity = Elasticity(body, Isotropic(E, nu), mean_dilatation=True)
    support = Support(body).platen("top").fix("top", x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -1.0)), support)
    return BodyOnRoad(system, "bottom", road, friction=mu)


# %% [markdown]
# The road: a random profile with wavelengths from 3 to 25 mm, put down at irregular places as a profilometer would, and read
# back from the file; between the samples it is a smooth spline, for a corner has no normal. Pressed on it, then dragged:

# %%
x = np.sort(np.random.default_rng(1).uniform(-25, 30, 300))
heights = rough_heights(x, 0.15, (3.0, 25.0), power=0.8)
write_profile(scene.out / "road.csv", x, heights - heights.max())
profile = SmoothRoad.through(*read_samples(scene.out / "road.csv"))
rubber, flat = tread(profile), tread(Plane())
full = pressure * rubber.area.sum() * rubber.problem.b
first = replace(rubber.problem, b=full)  # on the planes nearest at rest
first.save(scene.out / "problem.npz", solve(first, "direct"))  # for any other solver
path = press_and_drag(scene, "2-D", rubber, profile, pressure, sliding, steps, scene.out / "tread.xdmf")
on_flat = press_and_drag(scene, "flat road", flat, Plane(), pressure, sliding, steps)
paths = {"rough road": path, "flat road": on_flat}
stress = [rubber.elasticity.von_mises(rubber.displacement(solution)) for solution in path.solutions]
largest = max(s.max() for s in stress) / (1.5 * E / (1 + nu))
scene.result("largest_strain[2-D]", largest, "1", 0.1, "small, for linear strain", "at most")
scene.figure(area_and_friction(paths, mu), "area_and_friction")
begins = steps[0] + steps[1] * 3 // 8 - 1  # 1.5 mm: it begins to slide
scene.figure(stick_slip_along_the_road(rubber, path, begins, stress[begins], profile), "stick_and_slip_2d")
scene.finish(path.solutions[-1], **path.cost())

# %% [markdown]
# The blocks stick up to about 1 mm and slide altogether from 2.4 mm on. The strains at the corners are beyond linear strain.
#
# **In ParaView**, open `tread.xdmf`, and `tread_road.xdmf`, which moves, *Warp By Vector* on both, colour by `status`, and play.
#
# ## Exercises
#
# 1. Which part of the blocks touches at the full load, on the rough road and on a flat one?
# 2. On the flat road the force at the end is mu times the load. On the rough road it is less: how can that be?
# 3. After which way has every node slipped once? What does the flat road say?

# %% tags=["hide-cell"]
# 1. All of it on the flat road, about four fifths on the rough one.
assert scene.value("real_area[flat road]") > 0.99 > 0.95 > scene.value("real_area[2-D]") > 0.6
# 2. The normals lean, and with them the cones of friction: where nodes slide downhill the road pushes them on.
assert abs(scene.value("friction_at_the_end[flat road]") / mu - 1) < 1e-6
assert scene.value("friction_at_the_end[2-D]") < mu
# 3. Where no node sticks any more.
for name, each in paths.items():
    slides = [way for way, s in zip(each.way, each.solutions) if way and not (s.status == 2).any()]
    print(f"{name}: slides altogether from {min(slides, default=np.nan):.2f} mm on")

# %% [markdown]
# **Further reading.** B. N. J. Persson, *Theory of rubber friction and contact mechanics*, J. Chem. Phys. 115 (2001) 3840.
# T. J. R. Hughes, *Generalization of selective integration procedures to anisotropic and nonlinear media*, Int. J. Numer.
# Meth. Engng 15 (1980) 1413, for (a). Cords, and blocks in space: `reports/tread_blocks.py`.
