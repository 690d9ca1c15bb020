# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Friction: what converges, at what order, and what it costs
#
# The half cylinder of section 3.1.1, pressed under a rigid platen on a road with mu = 0.5. Friction depends on
# the path, and we have only points of it: within a step a node may stick where it was at the end of the last
# one, so that a node that touches within the step sticks where it was *before* it touched. The error of that
# is of first order in the step. With the mesh comes the second error, and with a finite body a third:
# Spence (1975) solved the problem of the half plane, where nothing but the load sets a length, so that
#
# $$ \frac{c}{a} = \text{const}, \qquad p(x) = \frac{P}{a} \hat p(x / a), \qquad a \sim \sqrt{P} \tag{1} $$
#
# while P grows: the stick zone |x| < c grows as the patch |x| < a does. No parameter of ours can make that
# true; the path must be right at every step.

# %%
from dataclasses import replace
from time import perf_counter

import matplotlib.pyplot as plt
import numpy as np
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder_nested
from model import BodyOnRoad, ContactSolver, NotConverged, Status, follow, solve
from model.closed_forms.hertz import HertzCylinder
from model.closed_forms.spence import Spence
from model.figures.figures import convergence_figure, new_figure
from model.results.pressure import line_error

scene = Scene("friction_refinement", "Friction: what converges, at what order, and what it costs.")
scene.built("K").left_out("M", "C", "gmsh", "pyvista")
R, E, nu, P, mu = 10.0, 210e3, 0.3, 1e4, 0.5  # mm, MPa, 1, N/mm, 1
assembly_seconds = 0.0


def pressed_cylinder(refinements, friction=mu, part=1.0):
    """Half cylinder under a platen and `part` of P; the inner block of its mesh shrinks with the patch."""
    global assembly_seconds
    began = perf_counter()
    size = np.sqrt(part)
    body = Body.from_grid(half_cylinder_nested(R, inner_half_width=0.1 * R * size), refinements)
    elasticity = Elasticity(body, Isotropic(E, nu))
    support = Support(body).platen("top").fix("top", x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -part * P)), support)
    pressed = BodyOnRoad(system, "arc", Plane(), friction=friction, reach=0.2 * R * size)
    assembly_seconds += perf_counter() - began
    return pressed


def path(pressed, steps, correction="direct", tolerance=1e-9):
    """All steps of the load up to its full size."""
    solver = ContactSolver(pressed.problem, correction, progress=False)
    return list(follow(solver, [pressed.problem.b * (k / steps) for k in range(1, steps + 1)], tolerance))


def order_of(sizes, errors):
    """Slope of the line through all points."""
    return np.polyfit(np.log(sizes), np.log(errors), 1)[0]


# %% [markdown]
# ## Refining the mesh, at ten steps

# %%
levels = range(1, 4) if scene.quick else range(2, 7)
profiles, widths = {}, {}
for k in scene.progress(levels, "meshes"):
    pressed = pressed_cylinder(k)
    last = path(pressed, 10, "multigrid")[-1]
    x = pressed.points[:, 0]
    order = np.argsort(x)
    profiles[k] = x[order], pressed.pressure(last)[order], pressed.traction(last)[order, 0]
    widths[k] = np.diff(x[order])[x.size // 2]
finest = profiles[levels[-1]]
coarser = list(levels)[:-1]
spacing = np.array([widths[k] for k in coarser])
mesh_errors = {
    "p0": np.array([abs(profiles[k][1].max() / finest[1].max() - 1) for k in coarser]),
    "p (L2)": np.array([line_error(*profiles[k][:2], lambda s: np.interp(s, *finest[:2])) for k in coarser]),
    "tau (L2)": np.array(
        [line_error(*profiles[k][::2], lambda s: np.interp(s, finest[0], finest[2])) for k in coarser]
    ),
}
for name, errors in mesh_errors.items():
    scene.result(f"error_on_the_coarsest_mesh[{name}]", errors[0], "1")
    scene.result(f"order_in_h[{name}]", order_of(spacing, errors), "1")
figure = convergence_figure(
    spacing,
    mesh_errors,
    "node spacing in the patch (mm)",
    "error against the finest mesh (relative)",
    order=1,
)
scene.figure(figure, "mesh_refinement")

# %% [markdown]
# ## Refining the steps, on one mesh
#
# Against eight times as many steps as the most that is drawn. The order holds while several nodes touch in a
# step; after that the answer changes only where a node touches on the other side of the end of a step.

# %%
counts = np.array([5, 10, 20] if scene.quick else [5, 10, 20, 40, 80])
pressed = pressed_cylinder(2 if scene.quick else 4)
K = pressed.problem.A
limit = path(pressed, 8 * counts[-1])[-1]
limit_tau = pressed.traction(limit)[:, 0]
step_errors = {"u (energy norm)": [], "tau (largest)": []}
for count in scene.progress(counts, "steps"):
    last = path(pressed, count)[-1]
    e, u = (last.displacement - limit.displacement).ravel(), limit.displacement.ravel()
    step_errors["u (energy norm)"].append(np.sqrt((e @ (K @ e)) / (u @ (K @ u))))
    distance = np.abs(pressed.traction(last)[:, 0] - limit_tau).max()
    step_errors["tau (largest)"].append(distance / np.abs(limit_tau).max())
for name, errors in step_errors.items():
    scene.result(f"error_of_ten_steps[{name}]", errors[1], "1")
    scene.result(f"order_in_steps[{name}]", -order_of(counts, errors), "1")
step_errors = {name: np.array(errors) for name, errors in step_errors.items()}
figure = convergence_figure(counts, step_errors, "steps", "error against the limit (relative)", order=-1)
scene.figure(figure, "step_refinement")

# %% [markdown]
# ## Self-similarity
#
# The load rises in forty steps to P/100, where a/R = 0.0074 and the body is as good as a half plane, and in
# another run to P. Patch and stick zone end half way between the last node inside and the first one outside;
# a line through the origin, fitted to all steps of a quarter of the loads, averages over that uncertainty.

# %%
quarters = {"25 to 50 %": (0.25, 0.5), "50 to 75 %": (0.5, 0.75), "75 to 100 %": (0.75, 1.0)}
figure, axes = new_figure("a, Spence (in units of the final a)", "half widths, computed (the same units)")
for part, mark, name in ((0.01, "o", "P/100"), (1.0, "x", "P")):
    pressed = pressed_cylinder(3 if scene.quick else 5, part=part)
    x = pressed.points[:, 0]
    h = np.diff(np.sort(x))[x.size // 2]
    spence = Spence(HertzCylinder(part * P, R, E, nu), mu)
    a, c = [], []
    for step in path(pressed, 40):
        a.append(np.abs(x[step.status != Status.FREE]).max() + h / 2)
        c.append(np.abs(x[step.status == Status.STICK]).max(initial=-h / 2) + h / 2)
    a, c, load = np.array(a), np.array(c), np.arange(1, 41) / 40
    exact = spence.a * np.sqrt(load)
    ratios = []
    for quarter, (low, high) in quarters.items():
        some = (load > low) & (load <= high)
        ratios.append(np.sum(a[some] * c[some]) / np.sum(a[some] ** 2))
        scene.result(f"c_over_a[{name}, {quarter}]", ratios[-1], "1", spence.c / spence.a, "Spence")
    scene.result(f"c_over_a_spread[{name}]", np.ptp(ratios) / np.mean(ratios), "1", 0.0, "eq. (1)")
    axes.plot(exact / spence.a, a / spence.a, mark, color="0.6", markersize=4, label=f"a, up to {name}")
    axes.plot(exact / spence.a, c / spence.a, mark, color="black", markersize=4, label=f"c, up to {name}")
axes.plot([0, 1], [0, 1], color="0.6", label="a, Spence")
axes.plot([0, 1], [0, spence.c / spence.a], "k--", label=f"c = {spence.c / spence.a:.3f} a, Spence")
axes.legend(frameon=False, fontsize="small")
scene.figure(figure, "self_similarity")

# %% [markdown]
# ## What it costs: V(1,1) cycles in the worst step, mu by mu
#
# Multigrid with nested iteration in every step, to a residual of 1e-8. A step that did not converge would be
# counted as a failure; so would one that took more than twice the cycles of the frictionless load.

# %%
mus = (0.01, 0.1, 0.3, 0.5, 1.0, 3.0)
grid_levels = (
    {1: (1, 2, 5), 2: (2,)} if scene.quick else {2: (1, 2, 5, 10, 50), 3: (1, 10, 50), 4: (5,), 5: (5,)}
)
if not scene.quick:
    grid_levels[6] = (2,)
worst, failures, ratio = {}, 0, 0.0
for k, step_counts in scene.progress(grid_levels.items(), "mu and steps"):
    pressed = pressed_cylinder(k, friction=None)
    dofs = pressed.problem.b.size
    smooth = solve(pressed.problem, "multigrid", tolerance=1e-8, progress=False).cycles
    scene.result(f"cycles[mu=0, dofs={dofs}]", smooth, "V(1,1)")
    for friction in mus if k < 6 else (mu,):
        pressed = pressed_cylinder(k, friction)
        for count in step_counts:
            try:
                worst[dofs, friction, count] = max(s.cycles for s in path(pressed, count, "multigrid", 1e-8))
            except NotConverged as error:
                failures += 1
                print(f"mu = {friction}, {count} steps, {dofs} unknowns: {error}")
            else:
                ratio = max(ratio, worst[dofs, friction, count] / smooth)
    most = max(cycles for (size, *_), cycles in worst.items() if size == dofs)
    scene.result(f"cycles_in_the_worst_step[dofs={dofs}]", most, "V(1,1)", 2 * smooth, "at most")
scene.result("steps_that_failed", failures, "1", 0)
scene.result("cycles_over_frictionless", ratio, "1", 2.0, "wanted, at most")
sizes = sorted({size for size, *_ in worst})
figure, panels = plt.subplots(
    1, len(sizes), figsize=(2 + 2.2 * len(sizes), 3.6), layout="constrained", squeeze=False
)
for axes, size in zip(panels[0], sizes, strict=True):
    rows = [friction for friction in mus if any(key[:2] == (size, friction) for key in worst)]
    columns = sorted({count for s, _, count in worst if s == size})
    table = np.array([[worst.get((size, friction, count), np.nan) for count in columns] for friction in rows])
    axes.imshow(table, cmap="Greys", vmin=0, vmax=40, aspect="auto")
    for (row, column), cycles in np.ndenumerate(table):
        axes.text(
            column, row, f"{cycles:.0f}", ha="center", va="center", color="white" if cycles > 20 else "black"
        )
    axes.set(title=f"{size:,} unknowns", xlabel="load steps")
    axes.set_xticks(range(len(columns)), columns)
    axes.set_yticks(range(len(rows)), [f"{friction:g}" for friction in rows])
panels[0, 0].set_ylabel(r"$\mu$")
scene.figure(figure, "cycles")

# %%
pressed = pressed_cylinder(3)
*_, before, last = path(pressed, 10)
reference = before.displacement[pressed.problem.contact_nodes]
replace(pressed.problem, tangential_reference=reference).save(scene.out / "problem.npz", last)
pressed.write(scene.out / "pressed.xdmf", last)
scene.cost(**last.cost(), assembly_seconds=assembly_seconds)
scene.finish()
