# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # The sphere, mesh by mesh, to a million unknowns, and what else there is
#
# The scene is that of `sphere_on_plane.py`, a quarter of the half ball without friction. The radius of the patch is
# where the parabola through the squares of the pressures ends; the order is that of the pressure in L2 over the
# patch, against the finest mesh. Partial slip is refined beside it.

# %%
from dataclasses import replace

import numpy as np
from bodies import NU, E, R, ball, order_of
from competitors import snes
from harness.scene import Scene

from model import ContactSolver, follow, solve
from model.closed_forms.hertz import HertzSphere
from model.closed_forms.mindlin import MindlinSphere
from model.figures.figures import convergence_figure, pressure_figure

scene = Scene(
    "sphere_refinement", "The sphere on the plane, mesh by mesh, beside PETSc's semismooth Newton method."
)
scene.built("K")
scene.left_out("M", "C", "gmsh", "pyvista")
ball = scene.assembly(ball)
F, mu = 15e3, 0.5
hertz = HertzSphere(F, R, E, NU)

# %%
levels = range(1, 4) if scene.quick else range(1, 5)
solve(ball("quarter", 1, F).problem, "multigrid", tolerance=1e-8)  # compiles
found, seconds = {}, {"multigrid": {}}
for k in scene.progress(levels, "meshes"):
    pressed = ball("quarter", k, F)
    solution = solve(pressed.problem, "multigrid", tolerance=1e-8)
    r, p, dofs = np.hypot(*pressed.points[:, :2].T), pressed.pressure(solution), pressed.problem.b.size
    inner = (solution.status > 0) & (r < 0.85 * r[solution.status > 0].max())
    slope, top = np.polyfit(r[inner] ** 2, p[inner] ** 2, 1)
    found[k] = {"pressed": pressed, "u": solution.displacement, "r": r, "p": p, "a": np.sqrt(-top / slope)}
    seconds["multigrid"][dofs] = solution.setup_seconds + solution.seconds
    scene.result(f"p0[dofs={dofs}]", p.max(), "MPa", hertz.p0, "Hertz")
    scene.result(f"a[dofs={dofs}]", found[k]["a"], "mm", hertz.a, "Hertz")
    scene.result(f"cycles[dofs={dofs}]", solution.cycles, "V(1,1)", 20, "wanted", "at most")
    scene.result(f"seconds[dofs={dofs}]", seconds["multigrid"][dofs], "s")
    scene.result(f"peak_memory[dofs={dofs}]", solution.peak_memory / 2**30, "GiB", 12, "wanted", "at most")

order = np.argsort(r)
errors = {"p0": [], "a": [], "pressure (L2)": []}
for k in levels[:-1]:
    coarse = found[k]
    weight = coarse["pressed"].area * (coarse["r"] < 1.1 * hertz.a)
    finest = np.interp(coarse["r"], r[order], p[order])
    off = np.sum(weight * (coarse["p"] - finest) ** 2) / np.sum(weight * finest**2)
    errors["p0"].append(abs(coarse["p"].max() / p.max() - 1))
    errors["a"].append(abs(coarse["a"] / found[levels[-1]]["a"] - 1))
    errors["pressure (L2)"].append(np.sqrt(off))
spacing = np.array([0.05 * R / 2**k for k in levels[:-1]])
for name, values in errors.items():
    scene.result(f"order[{name}]", order_of(spacing, values), "1, in the node spacing")
lines = {name: np.maximum(values, 1e-6) for name, values in errors.items()}
floors = {"half space against the elastic ball, p0": abs(hertz.p0 / p.max() - 1)}
label, slope = "error against the finest mesh (relative)", None if scene.quick else 1
scene.figure(convergence_figure(spacing, lines, "node spacing (mm)", label, slope, floors), "refinement")
line = np.abs(pressed.points[:, 1]) < 1e-9
x, title = pressed.points[line, 0], "Contact pressure on a line through the middle"
computed = {f"{dofs} unknowns": np.concatenate([p[line][::-1], p[line]])}
exact = {"Hertz": hertz.pressure}
picture = pressure_figure(np.concatenate([-x[::-1], x]), computed, exact, hertz.a, title)
scene.figure(picture, "pressure")

# %% [markdown]
# ## What else there is
#
# PETSc's semismooth Newton method with bounds, on the same matrices: with CG and algebraic multigrid (GAMG,
# rigid motions given), and with a sparse factorisation (MUMPS), which fills up quickly in space.

# %%
rivals = {
    "CG/GAMG": ("gamg", [1] if scene.quick else [1, 2, 3]),
    "MUMPS": ("mumps", [1] if scene.quick else [1, 2]),
}
for name, (linear, sizes) in rivals.items():
    label = f"vinewtonrsls + {name}"
    seconds[label] = {}
    for k in scene.progress(sizes, label):
        problem = found[k]["pressed"].problem
        start = np.zeros(problem.b.shape)
        start[:, 2] = -0.1  # in contact, or nothing would hold the ball
        answer = snes(problem, "vinewtonrsls", linear, start)
        size = problem.b.size
        seconds[label][size] = answer.seconds
        scene.result(f"seconds[{label}, dofs={size}]", answer.seconds, "s")
        difference = np.abs(answer.displacement - found[k]["u"]).max()
        scene.result(f"difference[{label}, dofs={size}]", difference, "mm", 0.0, "the node loop")
        if linear == "gamg":
            faster = answer.seconds / seconds["multigrid"][size]
            key = f"speedup_over_vinewtonrsls_gamg[dofs={size}]"
            scene.result(key, faster, "1", 20.0, "wanted at 300,000 unknowns", "at least")
converged = {found[k]["pressed"].problem.b.size: e for k, e in zip(levels, errors["pressure (L2)"])}
times = {name: np.array([s for n, s in line.items() if n in converged]) for name, line in seconds.items()}
lines = {name: np.array([converged[n] for n in line if n in converged]) for name, line in seconds.items()}
label = "error of the pressure (relative, L2)"
scene.figure(convergence_figure(times, lines, "seconds, set-up included", label), "error_against_run_time")

# %% [markdown]
# ## Partial slip on finer meshes

# %%
parts = (0.25, 0.5, 0.75)
for k in (1,) if scene.quick else (2, 3):
    smooth, rubbing = ball("half", k, F), ball("half", k, F, mu)
    laid_on = solve(smooth.problem, "multigrid").displacement[rubbing.problem.contact_nodes]
    problem = replace(rubbing.problem, tangential_reference=laid_on)
    push = rubbing.system.reduce(rubbing.elasticity.total_force("top", (mu * F / 2, 0.0, 0.0)))
    path = follow(ContactSolver(problem, "multigrid"), [problem.b + part * push for part in parts], 1e-8)
    for part, slipped in zip(parts, scene.progress(path, "Q", len(parts))):
        mindlin = MindlinSphere(hertz, part * mu * F, mu)
        sticking, touching = (rubbing.area[slipped.status >= kind].sum() for kind in (2, 1))
        key = f"Q={part} mu F, dofs={problem.b.size}"
        scene.result(f"c_over_a[{key}]", np.sqrt(sticking / touching), "1", mindlin.c / hertz.a, "Mindlin")
        scene.result(f"cycles[{key}]", slipped.cycles, "V(1,1)", 20, "wanted", "at most")

# %%
scene.finish(solution)
