# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # A sphere on a plane: Hertz and Mindlin in space
#
# The tyre of the paper's outlook is a body in space. The same loop, with blocks of three instead of two,
# meets its two closed forms there. A steel sphere of radius R is pressed by F on a rigid plane,
#
# $$ a^3 = \frac{3 F R}{4 E^*}, \qquad p_0 = \frac{3 F}{2 \pi a^2}, \qquad
#    p(r) = p_0 \sqrt{1 - r^2/a^2}, \tag{Hertz} $$
#
# and then pushed sideways by Q below the limit of friction: an annulus slips, a disc of radius c sticks,
#
# $$ c = a \left(1 - \frac{Q}{\mu F}\right)^{1/3}. \tag{Mindlin} $$
#
# The lower half of the ball is meshed with nested hexahedra: a block at the contact within growing shells. By
# symmetry a quarter of it will do for F, and a half for Q along x. Its flat face is a rigid platen.

# %%
from time import perf_counter

import numpy as np
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from forms.alternatives import vinewtonrsls
from geometry import Body, Plane, half_ball
from model import BodyOnRoad, ContactSolver, Status, follow, solve
from model.closed_forms.hertz import HertzSphere
from model.closed_forms.mindlin import MindlinSphere
from model.figures.contact_map import contact_map, cut_figure
from model.figures.figures import convergence_figure, pressure_figure
from model.results.xdmf import on_body

scene = Scene("sphere_on_plane", "A steel sphere pressed on a plane and pushed: Hertz and Mindlin in space.")
scene.built("K")
scene.left_out("M", "C", "gmsh")
R, E, nu, F, mu = 10.0, 210e3, 0.3, 15e3, 0.5  # mm, MPa, 1, N, 1
hertz = HertzSphere(F, R, E, nu)
share = {"quarter": 1 / 4, "half": 1 / 2, "whole": 1.0}
assembly_seconds = 0.0


def ball(part, refinements, friction=None):
    """Return a part of the half ball on the plane as a contact problem."""
    global assembly_seconds
    began = perf_counter()
    elasticity = Elasticity(Body.from_grid(half_ball(R, part), refinements), Isotropic(E, nu))
    support = Support(elasticity.body).platen("top").fix("y0", y=0.0)
    if part == "quarter":
        support.fix("x0", x=0.0)
    elif friction is None:
        support.fix("top", x=0.0)
    load = elasticity.total_force("top", (0.0, 0.0, -share[part] * F))
    system = support.apply(elasticity.stiffness(), load)
    road = Plane((0, 0, 0), (0, 0, 1))
    pressed = BodyOnRoad(elasticity, system, road, "sphere", friction, reach=0.15 * R)
    assembly_seconds += perf_counter() - began
    return pressed


# %% [markdown]
# ## Hertz, mesh by mesh
#
# The radius of the patch is where the parabola through the squares of the pressures ends; the order is that
# of the pressure in L2 over the patch, against the finest mesh.


# %%
def read_off(pressed, solution):
    """Radii and pressures of the nodes, greatest pressure, and radius of the patch."""
    radius, pressure = np.hypot(*pressed.points[:, :2].T), pressed.pressure(solution)
    inner = (solution.status != Status.FREE) & (radius < 0.85 * radius[solution.status != Status.FREE].max())
    slope, top = np.polyfit(radius[inner] ** 2, pressure[inner] ** 2, 1)
    return radius, pressure, pressure.max(), np.sqrt(-top / slope)


levels = range(1, 4) if scene.quick else range(1, 5)
solve(ball("quarter", 1).problem, "multigrid", tolerance=1e-8)  # compiles
found, seconds = {}, {"multigrid": {}}
for k in scene.progress(levels, "meshes"):
    pressed = ball("quarter", k)
    solution = solve(pressed.problem, "multigrid", tolerance=1e-8)
    dofs = pressed.problem.b.size
    found[k] = (dofs, pressed, solution, *read_off(pressed, solution))
    seconds["multigrid"][dofs] = solution.setup_seconds + solution.seconds
    scene.result(f"p0[dofs={dofs}]", found[k][5], "MPa", hertz.p0, "Hertz")
    scene.result(f"a[dofs={dofs}]", found[k][6], "mm", hertz.a, "Hertz")
    scene.result(f"cycles[dofs={dofs}]", solution.cycles, "1", 20, "wanted, at most")
    scene.result(f"seconds[dofs={dofs}]", seconds["multigrid"][dofs], "s")
    scene.result(f"peak_memory[dofs={dofs}]", solution.peak_memory / 2**30, "GiB")

dofs, pressed, solution, radius, pressure, p0, a = found[levels[-1]]
order = np.argsort(radius)
errors = {"p0": [], "a": [], "pressure (L2)": []}
for k in levels[:-1]:
    coarse, r, p = found[k][1], found[k][3], found[k][4]
    weight = coarse.area * (r < 1.1 * hertz.a)
    finest = np.interp(r, radius[order], pressure[order])
    errors["p0"].append(abs(found[k][5] / p0 - 1))
    errors["a"].append(abs(found[k][6] / a - 1))
    errors["pressure (L2)"].append(np.sqrt(np.sum(weight * (p - finest) ** 2) / np.sum(weight * finest**2)))
spacing = np.array([0.05 * R / 2**k for k in levels[:-1]])
for name, values in errors.items():
    rate = np.polyfit(np.log(spacing), np.log(values), 1)[0]
    scene.result(f"order[{name}]", rate, "1, in the node spacing")
scene.result("min_gap", solution.gap.min(), "mm", 0.0, "non-penetration")
scene.result("min_pressure", pressure.min(), "MPa", 0.0, "no adhesion")
balance = abs(4 * solution.pressure_force.sum() / F - 1)
scene.result("force_balance_error", balance, "1", 0.0, "equilibrium")

# %%
on_axis = np.abs(pressed.points[:, 1]) == 0
x = pressed.points[on_axis, 0]
figure = pressure_figure(
    np.concatenate([-x[::-1], x]),
    {f"{dofs} unknowns": np.concatenate([pressure[on_axis][::-1], pressure[on_axis]])},
    {"Hertz": hertz.pressure},
    hertz.a,
    "Contact pressure on a line through the middle",
)
scene.figure(figure, "pressure")
figure = convergence_figure(
    spacing,
    {name: np.maximum(e, 1e-6) for name, e in errors.items()},
    "node spacing (mm)",
    "error against the finest mesh (relative)",
    order=None if scene.quick else 1,
    floors={"half space against the elastic ball, p0": abs(hertz.p0 / p0 - 1)},
)
scene.figure(figure, "refinement")

# %% [markdown]
# ## What else there is
#
# PETSc's semi-smooth Newton method with bounds, on the same matrices: with CG and algebraic multigrid (GAMG,
# rigid motions given), and with a sparse factorisation (MUMPS), which fills up quickly in space.

# %%
rivals = {
    "vinewtonrsls + CG/GAMG": ("gamg", [1] if scene.quick else [1, 2, 3]),
    "vinewtonrsls + MUMPS": ("mumps", [1] if scene.quick else [1, 2]),
}
for name, (linear, sizes) in rivals.items():
    seconds[name] = {}
    for k in scene.progress(sizes, name):
        problem = found[k][1].problem
        start = np.zeros(problem.b.shape)
        start[:, 2] = -0.1  # in contact, or nothing would hold the ball
        answer = vinewtonrsls(problem, linear, start)
        seconds[name][problem.b.size] = answer.seconds
        scene.result(f"seconds[{name}, dofs={problem.b.size}]", answer.seconds, "s")
        difference = np.abs(answer.displacement - found[k][2].displacement).max()
        scene.result(f"difference[{name}, dofs={problem.b.size}]", difference, "mm", 0.0, "the node loop")
for n, spent in seconds["vinewtonrsls + CG/GAMG"].items():
    faster = spent / seconds["multigrid"][n]
    scene.result(f"speedup_over_vinewtonrsls_gamg[dofs={n}]", faster, "1", 20.0, "wanted at 300,000 unknowns")
converged = {found[k][0]: e for k, e in zip(levels, errors["pressure (L2)"])}
figure = convergence_figure(
    {name: np.array([s for n, s in times.items() if n in converged]) for name, times in seconds.items()},
    {name: np.array([converged[n] for n in times if n in converged]) for name, times in seconds.items()},
    "seconds, set-up included",
    "error of the pressure (relative, L2)",
)
scene.figure(figure, "error_against_run_time")

# %% [markdown]
# ## Mindlin: partial slip
#
# F first, without friction, so that the shear that it would cause (an elastic body on a rigid road spreads)
# is left out, as in the closed form; then Q in steps with friction. Nodes stick where F has left them. What the
# closed form leaves out still shows: at nu = 0.3 the push draws the pressure forwards.

# %%
level = 2 if scene.quick else 3
parts = [0.25, 0.5, 0.75]
smooth = solve(ball("half", level).problem, "multigrid", tolerance=1e-10)
rubbing = ball("half", level, friction=mu)
rubbing.problem.tangential_reference = smooth.displacement[rubbing.problem.contact_nodes]
pushes = [
    rubbing.elasticity.total_force("top", np.array([part * mu, 0.0, -1.0]) * share["half"] * F)
    for part in parts
]
loads = [np.where(rubbing.system.fixed, 0.0, rubbing.system.reduce(push)) for push in pushes]
solver = ContactSolver(rubbing.problem, "multigrid")
for part, slipped in zip(parts, scene.progress(follow(solver, loads, tolerance=1e-8), "Q", len(parts))):
    mindlin = MindlinSphere(hertz, part * mu * F, mu)
    sticking, touching = (rubbing.area[slipped.status >= kind].sum() for kind in (2, 1))
    scene.result(
        f"c_over_a[Q={part} mu F]", np.sqrt(sticking / touching), "1", mindlin.c / hertz.a, "Mindlin"
    )
    scene.result(f"cycles[Q={part} mu F]", slipped.cycles, "1")
tangential = np.linalg.norm(slipped.contact_force[:, :2], axis=1)
violation = np.max(tangential - mu * slipped.pressure_force) / slipped.pressure_force.max()
scene.result("max_coulomb_violation", max(violation, 0.0), "mu p0", 0.0, "Coulomb's law")
pushed = -2 * slipped.contact_force[:, 0].sum() / (parts[-1] * mu * F)
scene.result("tangential_balance_error", abs(pushed - 1), "1", 0.0, "equilibrium")

# %%
body, traction = rubbing.elasticity.body, rubbing.traction(slipped)
count = len(body.coordinates)
fields = {
    "pressure (MPa)": on_body(count, rubbing.nodes, rubbing.pressure(slipped)),
    "traction (MPa)": on_body(count, rubbing.nodes, np.linalg.norm(traction[:, :2], axis=1)),
}
status = on_body(count, rubbing.nodes, slipped.status)
title = f"Q = {parts[-1]} mu F: a disc sticks, an annulus slips"
scene.figure(
    contact_map(body, "sphere", fields, status, 1.3 * hertz.a, mirror=[1], title=title), "stick_and_slip"
)
on_axis = np.abs(rubbing.points[:, 1]) == 0
figure = pressure_figure(
    rubbing.points[on_axis, 0],
    {"p": rubbing.pressure(slipped)[on_axis], "tau": -traction[on_axis, 0]},
    {"Hertz": hertz.pressure, "Mindlin": mindlin.traction},
    hertz.a,
    "Pressure and traction along the push",
)
scene.figure(figure, "traction")
u = rubbing.displacement(slipped)
stress = rubbing.elasticity.von_mises(u)
picture = cut_figure(
    body, "y0", u, stress, "von Mises stress (MPa)", (0.0, 0.5), 2.5, "The cut through the middle, y = 0"
)
scene.figure(picture, "deformed")
rubbing.write(scene.out / "sphere.xdmf", slipped)
found[2][1].problem.save(scene.out / "problem.npz", found[2][2])

# %%
scene.cost(**solution.cost(), assembly_seconds=assembly_seconds)
scene.finish()
