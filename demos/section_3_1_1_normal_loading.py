# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Section 3.1.1: a cylinder pressed on a road
#
# An elastic cylinder of radius R is pressed with the force P per length on a rigid plane. Hertz's half-space
# theory gives
#
# $$ p(x) = p_0 \sqrt{1 - x^2/a^2}, \qquad p_0 = \sqrt{\frac{P E^*}{\pi R}},
#    \qquad a = \sqrt{\frac{4 P R}{\pi E^*}}, \qquad E^* = \frac{E}{1 - \nu^2} \tag{12, 13} $$
#
# The discrete problem is: find nodal displacements u and contact forces f with
#
# $$ K u = b + f, \qquad g_i = g_i^0 + n_i \cdot u_i \ge 0, \qquad p_i \ge 0, \qquad p_i g_i = 0,
#    \qquad |\tau_i| \le \mu p_i \tag{3, 5 to 7} $$
#
# UFL forms make K and b; the node loop does the rest. The lower half of the cylinder is meshed with 760
# bilinear quadrilaterals. The force comes as a uniform traction on the flat face, one node of it held in x,
# or through a rigid platen; we compare both.

# %%
from dataclasses import replace
from time import perf_counter, process_time

import numpy as np
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder, half_cylinder_nested
from model import BodyOnRoad, ContactSolver, follow, solve
from model.closed_forms.hertz import HertzCylinder
from model.closed_forms.spence import Spence
from model.figures.figures import body_picture, convergence_figure, mesh_figure, pressure_figure
from model.results.pressure import contact_half_width, line_error

scene = Scene(
    "section_3_1_1_normal_loading", "An elastic half cylinder pressed on a rigid road (paper, section 3.1.1)."
)
scene.built("K")
scene.left_out("M", "C", "gmsh")
R, E, nu, P, mu = 10.0, 210e3, 0.3, 1e4, 0.5  # mm, MPa, 1, N/mm, 1
hertz = HertzCylinder(P, R, E, nu)
assembly_seconds = 0.0


def cylinder(grid, refinements=0, loading="uniform", friction=None, force=P):
    """Return the half cylinder on the road as a contact problem."""
    global assembly_seconds
    began = perf_counter()
    body = Body.from_grid(grid, refinements)
    elasticity = Elasticity(body, Isotropic(E, nu))
    support = Support(body)
    if loading == "platen":
        support.platen("top").fix("top", x=0.0)
    else:
        support.fix_node(body.nearest_node((0.0, R)), x=0.0)
    system = support.apply(elasticity.stiffness(), elasticity.total_force("top", (0.0, -force)))
    pressed = BodyOnRoad(elasticity, system, Plane(), "arc", friction, reach=0.3 * R)
    assembly_seconds += perf_counter() - began
    return pressed


def read_off(pressed, solution, degree=1):
    """Positions, pressures, and the half width of the patch."""
    x, p = pressed.points[:, 0], pressed.pressure(solution)
    return x, p, contact_half_width(x, p, solution.status > 0, degree)


# %% [markdown]
# ## Without friction: figures 3b and 4

# %%
pressed = cylinder(half_cylinder(R))
solution = solve(pressed.problem, "direct", tolerance=1e-12)
x, p, patch = read_off(pressed, solution)
balance = abs(solution.contact_force[:, 1].sum() / P - 1)
scene.result("p0[mu=0]", p.max(), "MPa", hertz.p0, "Hertz, eq. (13); the paper: 8555")
scene.result("a[mu=0]", patch.interpolated, "mm", hertz.a, "Hertz, eq. (13); the paper: 0.75")
scene.result("a_lower[mu=0]", patch.lower, "mm", 0.73, "the paper, last node in contact")
scene.result("a_upper[mu=0]", patch.upper, "mm", 0.80, "the paper, first node out")
scene.result("pressure_L2_error[mu=0]", line_error(x, p, hertz.pressure), "1", 0.0, "Hertz, eq. (12)")
scene.result("min_gap[mu=0]", solution.gap.min(), "mm", 0.0, "eq. (5)")
scene.result("min_pressure[mu=0]", p.min(), "MPa", 0.0, "eq. (6)")
scene.result("force_balance_error[mu=0]", balance, "1", 0.0, "equilibrium")

# %% [markdown]
# ## The loop as printed, on the same discrete problem
#
# Relaxation removes short waves at once and long ones hardly at all. Under a platen, whose nodes fall together,
# the loop needs tens of thousands of sweeps; under a uniform traction, where the body must turn and fall node
# by node, more than a million (`error_against_run_time.py` counts them). Stopping early is not an option: a
# small increment is not a small error.

# %%
under_platen = cylinder(half_cylinder(R), loading="platen")
direct = solve(under_platen.problem, "direct", tolerance=1e-12)
relaxed = solve(under_platen.problem, "none", tolerance=1e-11, limit=30_000)
direct_p0, relaxed_p0 = (under_platen.pressure(answer).max() for answer in (direct, relaxed))
scene.result("p0[mu=0, platen]", direct_p0, "MPa", hertz.p0, "Hertz, eq. (13)")
scene.result("sweeps[correction=none]", relaxed.sweeps, "1")
scene.result("seconds[correction=none]", relaxed.seconds, "s", direct.seconds, "direct, this run")
scene.result("error_p0[correction=none]", abs(relaxed_p0 / direct_p0 - 1), "1", 0.0, "direct, this run")
loop, status, u = (
    ContactSolver(under_platen.problem, "none").loop,
    direct.status.copy(),
    direct.displacement.copy(),
)
loop.set_load(under_platen.problem.b, under_platen.problem.gap)
began = process_time()  # of this core: the machine may be shared
loop.sweep(u, status, 2000)
scene.result(
    "node_updates_per_second", 2000 * len(u) / (process_time() - began), "1/s", 15e6, "wanted, at least"
)

# %%
scene.figure(
    mesh_figure(pressed.elasticity.body, title="760 bilinear quadrilaterals (figure 3b)"), "figure_3b"
)
figure = pressure_figure(
    x, {"node loop": p}, {"Hertz, eq. (12)": hertz.pressure}, hertz.a, "Contact pressure, mu = 0 (figure 4)"
)
scene.figure(figure, "figure_4")
pressed.write(scene.out / "frictionless.xdmf", solution)
u, stress = pressed.displacement(solution), pressed.elasticity.von_mises(pressed.displacement(solution))
picture = body_picture(
    pressed.elasticity.body,
    u,
    stress,
    "von Mises stress (MPa)",
    centre=(0.0, 0.8),
    width=4.0,
    title="The contact zone",
)
scene.figure(picture, "deformed")

# %% [markdown]
# ## With friction, mu = 0.5, in ten steps: figure 5
#
# An elastic body on a rigid road draws itself together or spreads as it is pressed, so that normal loading
# alone causes shear: the peak grows, the patch shrinks a little, and its edge slips. Within a step a node
# sticks where it was at the end of the last one; the answer therefore depends on the number of steps, to
# first order. The flat face is a rigid platen held in x. Spence (1975) solved the half-plane problem; c/a
# does not depend on the load there.

# %%
spence = Spence(hertz, mu)
rubbing = cylinder(half_cylinder(R), loading="platen", friction=mu)
steps, peaks, widths = (10, 20) if scene.quick else (10, 20, 40, 80), [], []
for count in scene.progress(steps, "steps"):
    solver = ContactSolver(rubbing.problem, "direct")
    path = list(
        follow(solver, [rubbing.problem.b * (k / count) for k in range(1, count + 1)], tolerance=1e-12)
    )
    last = path[-1]
    rub_x, rub_p, rub_patch = read_off(rubbing, last, degree=2)
    peaks.append(rub_p.max())
    widths.append(rub_patch.interpolated)
    if count == 10:
        tau = rubbing.traction(last)[:, 0]
        excess = max(
            np.max(
                np.linalg.norm(s.contact_force - s.pressure_force[:, None] * [0, 1], axis=1)
                - mu * s.pressure_force
            )
            for s in path
        )
        stuck = np.abs(rub_x[last.status == 2]).max()
        scene.result("p0[mu=0.5]", peaks[0], "MPa", spence.p0, "Spence, half plane")
        scene.result("a[mu=0.5]", widths[0], "mm", spence.a, "Spence, half plane")
        scene.result("stick_half_width[mu=0.5]", stuck, "mm", spence.c, "Spence, half plane")
        scene.result(
            "max_coulomb_violation[mu=0.5]",
            max(excess, 0.0) / rubbing.area.min() / peaks[0],
            "p0",
            0.0,
            "eq. (7)",
        )
        total = last.contact_force.sum(axis=0)
        scene.result("force_balance_error[mu=0.5]", np.abs(total - [0, P]).max() / P, "1", 0.0, "equilibrium")
        stuck_at = path[-2].displacement[rubbing.problem.contact_nodes]
        replace(rubbing.problem, tangential_reference=stuck_at).save(scene.out / "problem.npz", last)
        rubbing.write(scene.out / "friction.xdmf", last)
        friction_figure = pressure_figure(
            rub_x,
            {"p": rub_p, "tau": tau},
            {"Hertz, mu = 0": hertz.pressure, "Spence, p": spence.pressure, "Spence, tau": spence.traction},
            hertz.a,
            "Pressure and traction, mu = 0.5, ten steps (figure 5)",
        )
    scene.result(f"p0[mu=0.5, steps={count}]", peaks[-1], "MPa")
    scene.result(f"a[mu=0.5, steps={count}]", widths[-1], "mm")
scene.result(
    "p0[mu=0.5, steps=limit]", 2 * peaks[-1] - peaks[-2], "MPa", spence.p0, "extrapolated; Spence, half plane"
)
scene.result(
    "a[mu=0.5, steps=limit]", 2 * widths[-1] - widths[-2], "mm", spence.a, "extrapolated; Spence, half plane"
)
scene.figure(friction_figure, "figure_5")

# %% [markdown]
# ## Refinement
#
# Nested meshes of 56 x 4^k quadrilaterals, both ways of loading. Errors are measured against the
# mesh-converged value of the same problem (Richardson from the two finest meshes); Hertz's own model error is
# the distance of that from eq. (13), drawn as a line.

# %%
levels = range(1, 5) if scene.quick else range(1, 7)
study = {}
for loading in ("uniform", "platen"):
    rows = []
    for k in scene.progress(levels, f"refinement, {loading}"):
        scene_k = cylinder(half_cylinder_nested(R), k, loading)
        sol = solve(scene_k.problem, "multigrid", tolerance=1e-10)
        xk, pk, patch_k = read_off(scene_k, sol)
        order = np.argsort(xk)
        rows.append((sol.seconds + sol.setup_seconds, pk.max(), patch_k.interpolated, xk[order], pk[order]))
    h = np.array([1.0 / 2**k for k in levels]) * 0.5  # node spacing under the contact, mm
    p0 = np.array([row[1] for row in rows])
    limit = p0[-1] + (p0[-1] - p0[-2]) / 3
    fine_x, fine_p = rows[-1][3:]
    true = lambda s, fx=fine_x, fp=fine_p: np.interp(s, fx, fp)  # noqa: E731
    errors = {
        "p0": np.abs(p0[:-1] / limit - 1),
        "a": np.abs(np.array([row[2] for row in rows[:-1]]) / rows[-1][2] - 1),
        "pressure (L2)": np.array([line_error(row[3], row[4], true) for row in rows[:-1]]),
    }
    study[loading] = (h[:-1], np.array([row[0] for row in rows[:-1]]), errors, limit)
    scene.result(f"p0[mesh-converged, {loading}]", limit, "MPa", hertz.p0, "Hertz, eq. (13)")


def rate(h, error):
    """Observed order: slope of the line through all meshes."""
    return np.polyfit(np.log(h), np.log(error), 1)[0]


h, seconds, errors, limit = study["uniform"]
scene.result("order_p0", rate(h, errors["p0"]), "1")
scene.result("order_pressure_L2", rate(h, errors["pressure (L2)"]), "1")
for name, (axis, label) in {
    "h": (0, "node spacing h (mm)"),
    "run_time": (1, "seconds, set-up included"),
}.items():
    figure = convergence_figure(
        {f"{quantity}, {loading}": study[loading][axis] for loading in study for quantity in errors},
        {f"{q}, {loading}": np.maximum(study[loading][2][q], 1e-7) for loading in study for q in errors},
        label,
        "error against the mesh-converged value (relative)",
        floors={"half-space theory against the elastic body, p0": abs(hertz.p0 / limit - 1)},
    )
    scene.figure(figure, f"refinement_{name}")

# %% [markdown]
# Hertz's model error is one of geometry, a/R = 0.074 here; it sinks with the load. The inner block of the
# mesh shrinks with the patch, so that each load is resolved alike.

# %%
loads = [1.0, 0.1] if scene.quick else [1.0, 0.1, 0.01, 0.001]
floor = []
for part in loads:
    small = HertzCylinder(part * P, R, E, nu)
    values = []
    for k in (3, 4):
        grid = half_cylinder_nested(R, inner_half_width=0.1 * R * np.sqrt(part))
        lighter = cylinder(grid, k, force=part * P)
        sol = solve(lighter.problem, "multigrid", tolerance=1e-10)
        values.append(lighter.pressure(sol).max())
    floor.append(abs((values[1] + (values[1] - values[0]) / 3) / small.p0 - 1))
    scene.result(f"hertz_model_error[load={part:g}]", floor[-1], "1", 0.0, "p0 against eq. (13)")
figure = convergence_figure(
    np.array([HertzCylinder(part * P, R, E, nu).a / R for part in loads]),
    {"p0": np.array(floor)},
    "a/R",
    "p0 against Hertz (relative)",
)
scene.figure(figure, "hertz_model_error")

# %%
scene.cost(**solution.cost(), assembly_seconds=assembly_seconds)
scene.finish()
