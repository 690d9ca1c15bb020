# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # A tread block on a rough road
#
# What a tyre does with the road, in small: rubber blocks with grooves between them are pressed on a rough
# road by a rigid platen, and the road is pulled away below them. At each step the displacement u and the
# contact forces satisfy
#
# $$ K u = b + f, \qquad g(x + u) \ge 0, \qquad p \ge 0, \qquad p\,g = 0, \qquad |\tau| \le \mu p, $$
#
# with g the distance to the nearest point of the road where it is at that time, p along its normal there and
# tau across it. A node sticks to the road, and moves with it, until that takes more than mu p.
#
# Rubber is nearly incompressible (nu = 0.49): each cell has one dilatation, its mean. Strain is linear, which
# strains of ten percent and more stretch; the run says how large they are.

# %%
from time import perf_counter

import matplotlib.pyplot as plt
import numpy as np
from harness.scene import Scene
from matplotlib.collections import PolyCollection

from forms import Anisotropic, Elasticity, Isotropic, Support
from geometry import Body, MovingRoad, SmoothRoad, read_samples, tread_block
from model import BodyOnRoad, ContactSolver, Status, solve
from model.figures.contact_map import MARKS, contact_map
from model.figures.figures import COLOUR_MAP, LOOKS, new_figure, outlines
from model.quasistatics.curved_contact import CurvedContact
from model.results.xdmf import Series, on_body

scene = Scene("tread_block", "A rubber tread block pressed on a rough road and dragged over it.")
scene.built("K")
scene.left_out("M", "C", "gmsh", "pyvista")
E, nu, mu = 5.0, 0.49, 0.8  # MPa, 1, 1
block, groove, height, base = 8.0, 2.0, 6.0, 4.0  # mm
pressure, sliding = 0.3, 4.0  # mean pressure on the blocks (MPa), way of the road (mm)
rubber = Isotropic(E, nu)
corded = Anisotropic(rubber.matrix("3d") + np.diag([4 * E, 0, 0, 0, 0, 0]))  # stiff along x: orthotropic
assembly_seconds = 0.0


# %% [markdown]
# ## Roads
#
# A random profile with wavelengths from 3 to 25 mm and heights that grow with them as measured roads' do, put
# down as a profilometer would, and read back from the file; and a surface likewise.


# %%
def waves(count, longest, shortest, seed):
    """Wave vectors (n, count), amplitudes and phases (n,) of a rough road."""
    random = np.random.default_rng(seed)
    lengths = np.geomspace(shortest, longest, 24)
    angle = random.uniform(0, np.pi, 24) if count == 2 else np.zeros(24)
    vectors = 2 * np.pi / lengths[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)[:, :count]
    return vectors, lengths**0.8, random.uniform(0, 2 * np.pi, 24)


def rough(positions, roughness, seed=3):
    """Heights (m,), the highest 0, with the given standard deviation."""
    vectors, amplitudes, phases = waves(positions.shape[1], 25.0, 3.0, seed)
    heights = np.cos(positions @ vectors.T + phases) @ amplitudes
    return roughness * (heights - heights.max()) / heights.std()


x = np.sort(np.random.default_rng(1).uniform(-25, 30, 300))  # irregular spacing
np.savetxt(
    scene.out / "road.csv", np.stack([x, rough(x[:, None], 0.15)], axis=1), delimiter=",", header="x,height"
)
profile = SmoothRoad.through(*read_samples(scene.out / "road.csv"))
line = np.arange(-25.0, 30.0, 0.5)
places = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
surface = SmoothRoad.through(places, rough(places, 0.15))


# %%
def tread(dim, spacing, material, road, refinements=0):
    """Return the tread above the road, loaded by one unit of force on its platen."""
    global assembly_seconds
    began = perf_counter()
    size = ((3,), (block,), (groove,)) if dim == 2 else ((3, 2), (block, block), (groove, groove))
    body = Body.from_grid(tread_block(*size, height, base, spacing), refinements)
    elasticity = Elasticity(body, material, mean_dilatation=True)
    held = {"x": 0.0} if dim == 2 else {"x": 0.0, "y": 0.0}
    load = elasticity.total_force("top", -np.eye(dim)[-1])
    system = Support(body).platen("top").fix("top", **held).apply(elasticity.stiffness(), load)
    pressed = BodyOnRoad(elasticity, system, road, "bottom", mu)
    assembly_seconds += perf_counter() - began
    return pressed


def press_and_drag(name, pressed, road, steps, on_step=None):
    """Return rows of (mean pressure, way, tangential force, real area), and the solutions."""
    dim, area = pressed.points.shape[1], pressed.area.sum()
    moving = MovingRoad(road, -np.eye(dim)[0])  # its time is the way
    loads = np.linspace(0, pressure * area, steps[0] + 1)[1:]
    path = [(0.0, load) for load in loads]
    path += [(way, loads[-1]) for way in np.linspace(0, sliding, steps[1] + 1)[1:]]
    contact = CurvedContact(ContactSolver(pressed.problem, "direct"), pressed.points)
    follow = contact.follow(moving, ((way, load * pressed.problem.b) for way, load in path), tolerance=1e-8)
    rows, solutions, off, rounds = [], [], 0.0, 0
    for (way, load), solution in zip(path, scene.progress(follow, name, len(path))):
        solutions.append(solution)
        touching, force = solution.status != Status.FREE, solution.contact_force.sum(axis=0)
        rows.append((load / area, way, -force[0] / load, pressed.area[touching].sum() / area))
        pressed.road = moving.at(way)
        at = pressed.points + solution.displacement[pressed.problem.contact_nodes]
        off, rounds = (
            max(off, np.abs(pressed.road.closest(at[touching])[0]).max()),
            rounds + len(contact.distances),
        )
        if on_step is not None:
            on_step(len(rows), solution)
    length = np.ptp(pressed.problem.coordinates, axis=0).max()
    scene.result(f"off_the_road[{name}]", off / length, "body lengths", 1e-12, "wanted, at most")
    scene.result(f"residual[{name}]", max(s.residual for s in solutions), "1", 1e-8, "asked for, at most")
    scene.result(f"real_area[{name}]", rows[steps[0] - 1][3], "of the blocks")
    scene.result(f"friction_at_the_end[{name}]", rows[-1][2], "of the load", mu, "mu, on a flat road")
    scene.result(f"rounds_a_step[{name}]", rounds / len(rows), "1")
    scene.result(f"cycles_a_step[{name}]", sum(s.cycles for s in solutions) / len(rows), "1")
    return np.array(rows), solutions


# %% [markdown]
# ## In the plane: rubber, and rubber with stiff cords along x

# %%
steps = (8, 16) if scene.quick else (20, 80)
spacing = 1.0 if scene.quick else 0.5
flat = tread(2, spacing, rubber, profile)
series = Series(scene.out / "tread.xdmf", flat.elasticity.body)
paths = {}
paths["2-D"], in_plane = press_and_drag(
    "2-D", flat, profile, steps, on_step=lambda step, s: series.write(step, *flat.fields(s))
)
stress = max(flat.elasticity.von_mises(flat.displacement(s)).max() for s in in_plane)
scene.result("largest_strain[2-D]", stress / (1.5 * E / (1 + nu)), "1", 0.1, "small, for linear strain")
cords = tread(2, spacing, corded, profile)
paths["2-D, cords along x"], _ = press_and_drag("2-D cords", cords, profile, steps)

# %% [markdown]
# ## In space: two rows of three blocks on a rough surface

# %%
steps_3d = (4, 6) if scene.quick else (10, 30)
solid = tread(3, 2.0, rubber, surface, refinements=0 if scene.quick else 1)
paths["3-D"], in_space = press_and_drag("3-D", solid, surface, steps_3d)

# %% [markdown]
# ## Figures

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(9.6, 3.8), layout="constrained")
for look, (name, rows) in zip(LOOKS, paths.items(), strict=False):
    pressing, dragging = rows[rows[:, 1] == 0], rows[rows[:, 0] == rows[-1, 0]]
    left.plot(
        np.append(0, pressing[:, 0]), np.append(0, pressing[:, 3]), label=name, markerfacecolor="none", **look
    )
    few = max(1, len(dragging) // 12)
    right.plot(dragging[:, 1], dragging[:, 2], label=name, markerfacecolor="none", markevery=few, **look)
left.set(xlabel="mean pressure (MPa)", ylabel="real contact area (of the blocks)")
right.set(xlabel="way of the road (mm)", ylabel="tangential force (of the load)")
right.axhline(mu, color="0.5", linestyle=":", label="mu")
left.legend(frameon=False)
right.legend(frameon=False)
scene.figure(figure, "area_and_friction")

# %% [markdown]
# Where it sticks and slips: the body as it begins to slide, and every step under the full load
# drawn on the road.

# %%
begins = steps[0] + steps[1] * 3 // 8 - 1  # 1.5 mm
body, u = flat.elasticity.body, flat.displacement(in_plane[begins])
moved = body.coordinates + u
figure, panels = plt.subplots(3, 1, figsize=(8, 8), layout="constrained", height_ratios=[4, 1, 4])
colours = PolyCollection(list(moved[outlines(body.cells)]), cmap=COLOUR_MAP, edgecolor="face")
colours.set_array(flat.elasticity.von_mises(u))
panels[0].add_collection(colours)
figure.colorbar(colours, ax=panels[0], label="von Mises stress (MPa)")
way = paths["2-D"][begins, 1]
fine = np.linspace(-18, 21, 2000)
panels[0].fill_between(fine, profile.height(fine[:, None] + way), -2.0, color="0.8", linewidth=0)
panels[1].plot(fine, profile.height(fine[:, None]), color="black")
for kind, (colour, name) in MARKS.items():
    panels[0].plot(
        *moved[flat.nodes[in_plane[begins].status == kind]].T, "o", color=colour, markersize=4, label=name
    )
    for row, solution in zip(paths["2-D"][steps[0] - 1 :], in_plane[steps[0] - 1 :]):
        on_road = flat.points[:, 0] + solution.displacement[flat.problem.contact_nodes, 0] + row[1]
        here = on_road[solution.status == kind]
        panels[2].plot(here, np.full(here.shape, row[1]), ".", color=colour, markersize=5)
panels[0].set(aspect="equal", xlim=(-18, 21), ylim=(-2, 10.5), xlabel="x (mm)", ylabel="y (mm)")
panels[0].legend(frameon=False, loc="upper right")
panels[1].set(xlim=(-16, 20), ylabel="height (mm)")
panels[2].set(xlim=(-16, 20), xlabel="x on the road (mm)", ylabel="way of the road (mm)")
scene.figure(figure, "stick_and_slip_2d")

# %%
begins = steps_3d[0] + steps_3d[1] // 3 - 1  # 1.33 mm
body, traction = solid.elasticity.body, solid.traction(in_space[begins])
spread = lambda values: on_body(len(body.coordinates), solid.nodes, values)  # noqa: E731
fields = {
    "pressure (MPa)": spread(solid.pressure(in_space[begins])),
    "traction along x (MPa)": spread(-traction[:, 0]),
}
title = f"Two rows of three blocks after {paths['3-D'][begins, 1]:.2f} mm"
figure = contact_map(body, "bottom", fields, spread(in_space[begins].status), 15.0, title=title)
scene.figure(figure, "stick_and_slip_3d")
on_road = solid.points + in_space[begins].displacement[solid.problem.contact_nodes]
on_road[:, 0] += paths["3-D"][begins, 1]
across = np.stack(np.meshgrid(np.linspace(-17, 19, 145), np.linspace(-12, 12, 97), indexing="ij"), axis=-1)
heights = surface.height(across.reshape(-1, 2)).reshape(across.shape[:2])
figure, axes = new_figure("x on the road (mm)", "y (mm)", title, (8, 5))
shades = axes.contourf(across[..., 0], across[..., 1], heights, 12, cmap="Greys_r", alpha=0.6)
figure.colorbar(shades, label="height of the road (mm)")
for kind, (colour, name) in MARKS.items():
    axes.plot(*on_road[in_space[begins].status == kind, :2].T, ".", color=colour, markersize=5, label=name)
axes.set_aspect("equal")
axes.legend(loc="lower left")
scene.figure(figure, "on_the_road_3d")
solid.write(scene.out / "tread_3d.xdmf", in_space[-1])

# %% [markdown]
# For any other solver: the tread in the plane, pressed on the planes that are nearest to its nodes at rest, which
# is the first round of all.

# %%
first = tread(2, spacing, rubber, profile).problem
first.b = pressure * flat.area.sum() * first.b
first.save(scene.out / "problem.npz", solve(first, "direct"))

# %%
scene.cost(
    dofs=solid.problem.b.size,
    contact_candidates=solid.problem.contact_nodes.size,
    sweeps=sum(s.sweeps for s in in_space),
    cycles=sum(s.cycles for s in in_space),
    work_units=sum(s.work_units for s in in_space),
    assembly_seconds=assembly_seconds,
    solve_seconds=sum(s.seconds + s.setup_seconds for s in in_space),
    residual=in_space[-1].residual,
)
scene.finish()
