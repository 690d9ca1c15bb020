# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Error against run time
#
# How long does an answer take, and how good is it? Two errors must be told apart:
#
# $$ \underbrace{\|u_h^{(k)} - u_h\|}_{\text{algebraic: more cycles help}} \quad\text{and}\quad
#    \underbrace{\|u_h - u\|}_{\text{discretisation: only a finer mesh helps}} \tag{1} $$
#
# Cycles spent after the first has sunk below the second are wasted. The scene is Hertz's (section 3.1.1 of
# the paper: R = 10 mm, E = 210 GPa, nu = 0.3, P = 10 kN/mm, no friction, uniform traction on the flat face),
# on nested meshes of 56 x 4^k quadrilaterals. We measure in the energy norm, $\|v\|_A^2 = v^T A v$, and in
# what an engineer reads off: p0, a and the pressure.
#
# One work unit is the time of one sweep of the node loop over the finest mesh. Everything counts, also the
# set-up. Each runs on one core with the BLAS kernel that suits the processor (`make reports` unsets what would force
# another; the summary names the kernels), MUMPS with the ordering that is fastest here.

# %%
from time import perf_counter

import matplotlib.pyplot as plt
import numpy as np
from bodies import NU, E, P, R, cylinder
from competitors import ORDERINGS, penalty, snes, tao
from harness.machine import machine, triad_bandwidth
from harness.readings import read_patch
from harness.scene import Scene

from forms import Support
from geometry import Plane, half_cylinder
from model import BodyOnRoad, ContactSolver, NotConverged, Status, follow, solve
from model.closed_forms.hertz import HertzCylinder
from model.figures.figures import LOOKS, convergence_figure

scene = Scene(
    "error_against_run_time", "Error against run time: this project's corrections and what else there is."
)
scene.built("K")
scene.left_out("M", "C", "gmsh", "pyvista")
cylinder = scene.assembly(cylinder)
mu, hertz = 0.5, HertzCylinder(P, R, E, NU)
levels = range(1, 5) if scene.quick else range(1, 8)
if machine()["coretype"]:
    print(f"OPENBLAS_CORETYPE={machine()['coretype']} may slow MUMPS down: `make reports` runs without it.")


def energy(problem, u):
    """Potential energy of displacement u."""
    return 0.5 * u.ravel() @ (problem.A @ u.ravel()) - np.sum(problem.b * u)


def algebraic_error(problem, u, exact):
    """Relative distance in the energy norm."""
    e = (u - exact).ravel()
    return np.sqrt(max(e @ (problem.A @ e), 0.0) / (exact.ravel() @ (problem.A @ exact.ravel())))


def timed(problem, correction, tolerance, repeat=2, **options):
    """Solve from scratch, set-up included; the quicker of `repeat` runs."""
    runs = []
    for _ in range(repeat):
        solver = ContactSolver(problem, correction, progress=False)
        solution = solver.solve(tolerance=tolerance, **options)
        runs.append((solution.setup_seconds + solution.seconds, solution))
    return min(runs, key=lambda run: run[0])


# %% [markdown]
# ## Geometric multigrid, mesh by mesh
#
# For each mesh: the discrete solution (residual 1e-11), then runs to rising accuracy. A linear problem of the
# same size is solved by the same cycles: the final contact set is prescribed and nothing is left to decide.


# %%
def linear_twin(pressed, solution):
    """The linear problem with the final contact set prescribed.

    One node far from the road keeps the code path.
    """
    body, held = pressed.elasticity.body, pressed.nodes[solution.status != Status.FREE]
    support = Support(body).fix_node(body.nearest_node((0.0, R)), x=0.0)
    for node in held:
        support.fix_node(int(node), y=-body.coordinates[node, 1])
    load = pressed.elasticity.total_force("top", (0.0, -P))
    twin = BodyOnRoad(pressed.elasticity.system(load, support), "arc", Plane((0.0, -R)), reach=1.3 * R)
    return twin.problem


tolerances = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
timed(cylinder(1).problem, "multigrid", 1e-8)  # compiles
scenes, exact, found, histories, linear_seconds = {}, {}, {}, {}, {}
for k in scene.progress(levels, "meshes"):
    pressed = cylinder(k)
    problem, dofs = pressed.problem, pressed.problem.b.size
    exact[k] = solve(problem, "multigrid", tolerance=1e-11, progress=False)
    histories[k] = []
    for tolerance in tolerances:
        seconds, solution = timed(problem, "multigrid", tolerance)
        sweep = seconds / solution.work_units
        histories[k].append(
            (
                seconds,
                solution.seconds / sweep,
                algebraic_error(problem, solution.displacement, exact[k].displacement),
            )
        )
    final, final_seconds = solution, seconds
    memory = final.peak_memory
    linear_seconds[k] = timed(linear_twin(pressed, final), "multigrid", 1e-8)[0] if k < 7 else np.nan
    patch = read_patch(pressed, final)
    matrix = pressed.system.A
    found[k] = {
        "dofs": dofs,
        "seconds": seconds,
        "work_units": final.work_units,
        "cycles": final.cycles,
        "sweep": final_seconds / final.work_units,
        "bytes": sum(v.nbytes for v in (matrix.data, matrix.indices, matrix.indptr)) + 3 * problem.b.nbytes,
        "p0": patch.p.max(),
        "a": patch.width.interpolated,
        "pressure": (patch.x, patch.p),
        "energy": energy(problem, exact[k].displacement),
        "norm": np.sqrt(exact[k].displacement.ravel() @ (problem.A @ exact[k].displacement.ravel())),
        "residual": final.residual,
        "sweeps": final.sweeps,
        "candidates": problem.contact_nodes.size,
    }
    scene.result(f"cycles[dofs={dofs}]", final.cycles, "V(1,1)", 16, "V(2,2) cycles of an earlier prototype")
    scene.result(f"seconds[dofs={dofs}]", seconds, "s")
    if k <= 5:
        scenes[k] = pressed

# %% [markdown]
# The mesh-converged values come from the two finest meshes (Richardson, energy and p0 of order 2 in h; a and
# the pressure from the finest). Their distance to Hertz's closed form is the error of the half-space theory,
# not of the mesh.

# %%
finest, before = found[levels[-1]], found[levels[-2]]
converged = {
    "energy": finest["energy"] + (finest["energy"] - before["energy"]) / 3,
    "p0": finest["p0"] + (finest["p0"] - before["p0"]) / 3,
    "a": finest["a"],
}
scene.result("p0[mesh-converged]", converged["p0"], "MPa", hertz.p0, "Hertz, eq. (13)")
scene.result("a[mesh-converged]", converged["a"], "mm", hertz.a, "Hertz, eq. (13)")


def pressure_error(x, p, exact_x, exact_p):
    """Relative distance in L2 along the road."""
    fine = np.linspace(-1.2 * hertz.a, 1.2 * hertz.a, 4001)
    true = np.interp(fine, exact_x, exact_p)
    return np.linalg.norm(np.interp(fine, x, p) - true) / np.linalg.norm(true)


errors = {"p0": {}, "a": {}, "pressure": {}, "energy": {}}
units_to_accuracy = {}
for k in levels:
    f = found[k]
    errors["energy"][k] = np.sqrt(2 * max(f["energy"] - converged["energy"], 0.0)) / f["norm"]
    errors["p0"][k] = abs(f["p0"] / converged["p0"] - 1)
    errors["a"][k] = abs(f["a"] / converged["a"] - 1)
    errors["pressure"][k] = pressure_error(*f["pressure"], *finest["pressure"])
    units_to_accuracy[k] = next(units for _, units, error in histories[k] if error < errors["energy"][k])
    scene.result(
        f"work_units_to_discretisation_accuracy[dofs={f['dofs']}]",
        units_to_accuracy[k],
        "sweeps",
        10,
        "Brandt",
        "at most",
    )
large = [k for k in levels if found[k]["dofs"] > 20_000]
scene.result(
    "work_units_to_discretisation_accuracy",
    max(units_to_accuracy[k] for k in large),
    "sweeps",
    10,
    "Brandt; set-up apart",
    "at most",
)
scene.result("work_units_to_1e-8", max(found[k]["work_units"] for k in large), "sweeps, set-up included")
triad = triad_bandwidth(32 if scene.quick else 256)
scene.result("triad_bandwidth", triad / 1e9, "GB/s", None, "a = b + s c, one core")
for k in levels:
    f = found[k]
    per_sweep, whole = f["bytes"] / f["dofs"], f["seconds"] * triad / f["dofs"]
    used = f["bytes"] / f["sweep"] / triad
    scene.result(
        f"bytes_of_a_sweep_per_unknown[dofs={f['dofs']}]", per_sweep, "bytes", None, "A, u, b, residual"
    )
    scene.result(
        f"bandwidth_of_a_sweep[dofs={f['dofs']}]", used, "of triad", 1.0, "moved once, at triad's speed"
    )
    scene.result(
        f"bytes_per_unknown_in_the_time_of_a_solve[dofs={f['dofs']}]",
        whole,
        "bytes, by triad",
        None,
        "to 1e-8",
    )
scene.result("peak_memory_per_dof", memory / finest["dofs"], "bytes")
scene.result(
    "cost_ratio_to_linear_solve",
    max(found[k]["seconds"] / linear_seconds[k] for k in large if np.isfinite(linear_seconds[k])),
    "1",
    1.5,
    "wanted",
    "at most",
)

# %% [markdown]
# ## The others, on the same matrices

# %%
start = {k: np.zeros(scenes[k].problem.b.shape) for k in scenes}
for u in start.values():
    u[:, 1] = -0.05  # PETSc and the penalty form need a first guess in contact; it costs them nothing

orderings = {}
for name in scene.progress(["AMD", "METIS"] if scene.quick else ORDERINGS, "orderings of MUMPS"):
    problem, u = scenes[4].problem, start[4]
    orderings[name] = min(snes(problem, "vinewtonrsls", "mumps", u, ordering=name).seconds for _ in range(2))
    scene.result(f"seconds[vinewtonrsls + MUMPS, {name}, dofs={problem.b.size}]", orderings[name], "s")
best = min(orderings, key=orderings.get)


def rival(method, kind, linear):
    """Seconds and displacement of a competitor on a mesh."""

    def run(k):
        answer = method(scenes[k].problem, kind, linear, start[k], ordering=best)
        return answer.seconds, answer.displacement

    return run


def ours(name, tolerance, repeat, **options):
    """Seconds and displacement of a correction of this project on a mesh."""

    def run(k):
        spent, solution = timed(scenes[k].problem, name, tolerance, repeat, **options)
        return spent, solution.displacement

    return run


small, middle, large_ones = range(1, 2), range(1, 4), range(1, 5 if scene.quick else 6)
others = {
    "loop as printed": (small if scene.quick else range(1, 3), ours("none", 1e-8, 1, limit=20_000)),
    "direct": (large_ones, ours("direct", 1e-10, 2)),
    "algebraic": (large_ones, ours("algebraic", 1e-8, 1)),
    "vinewtonrsls + MUMPS": (large_ones, rival(snes, "vinewtonrsls", "mumps")),
    "vinewtonrsls + CG/GAMG": (middle if scene.quick else large_ones, rival(snes, "vinewtonrsls", "gamg")),
    "GPCG + MUMPS": (large_ones, rival(tao, "gpcg", "mumps")),
    "GPCG + CG/GAMG": (middle if scene.quick else large_ones, rival(tao, "gpcg", "gamg")),
    "BNLS + MUMPS": (large_ones, rival(tao, "bnls", "mumps")),
    "BLMVM": (small, rival(tao, "blmvm", "")),
    "BQPIP + MUMPS": (small, rival(tao, "bqpip", "mumps")),
    "vinewtonssls + MUMPS": (small, rival(snes, "vinewtonssls", "mumps")),
}
seconds, reached = {"multigrid": {k: found[k]["seconds"] for k in levels}}, {}
for name, (sizes, run) in scene.progress(others.items(), "other solvers"):
    seconds[name] = {}
    if name in ("direct", "algebraic"):
        run(1)  # compiles
    for k in sizes:
        try:
            seconds[name][k], u = run(k)
        except (NotConverged, RuntimeError) as error:
            print(f"{name} on {found[k]['dofs']} unknowns: {error}")
            scene.result(f"did_not_converge[{name}, dofs={found[k]['dofs']}]", 1, "1", 0)
        else:
            reached[name, k] = algebraic_error(scenes[k].problem, u, exact[k].displacement)
            scene.result(f"seconds[{name}, dofs={found[k]['dofs']}]", seconds[name][k], "s")
            scene.result(f"algebraic_error[{name}, dofs={found[k]['dofs']}]", reached[name, k], "1")
nearest = max(scenes)
rivals = [name for name in list(others)[3:] if nearest in seconds[name]]
fastest = min(rivals, key=lambda name: seconds[name][nearest])
multigrid_seconds = found[nearest]["seconds"]
speedup = seconds["vinewtonrsls + MUMPS"][nearest] / multigrid_seconds
scene.result("speedup_over_vinewtonrsls_mumps", speedup, "1", 10.0, f"wanted; MUMPS with {best}", "at least")
speedup = seconds[fastest][nearest] / multigrid_seconds
scene.result("speedup_over_the_fastest_competitor", speedup, "1", 10.0, f"wanted; {fastest}", "at least")

# %% [markdown]
# The loop on the paper's 760 quadrilaterals, against the direct correction at the same algebraic error.

# %%
paper = cylinder(grid=half_cylinder(R)).problem
paper_exact = solve(paper, "direct", tolerance=1e-12, progress=False).displacement
loop_seconds, loop = timed(paper, "none", 1e-3 if scene.quick else 1e-8, 1, limit=20_000)
direct_seconds, direct = timed(paper, "direct", 1e-8, 5)
scene.result("speedup_over_loop_760", loop_seconds / direct_seconds, "1", 1000.0, "wanted", "at least")
scene.result("algebraic_error[loop, 760]", algebraic_error(paper, loop.displacement, paper_exact), "1")
scene.result("sweeps[loop, 760]", loop.sweeps, "1")

# %% [markdown]
# The penalty form: its error is set by its stiffness, and shows as penetration.

# %%
k = 3
problem, body = scenes[k].problem, scenes[k].elasticity.body
load = scenes[k].elasticity.total_force("top", (0.0, -P))
held = np.array([2 * body.nearest_node((0.0, R))])
penalised = {}
for stiffness in (1e2 * E / R, 1e4 * E / R, 1e6 * E / R):
    answer = penalty(scenes[k].elasticity, load, "arc", stiffness, held, start[k])
    depth = -(body.coordinates + answer.displacement)[scenes[k].nodes, 1].min()
    error = algebraic_error(problem, answer.displacement, exact[k].displacement)
    penalised[stiffness] = (answer.seconds, error)
    scene.result(
        f"penetration[penalty={stiffness * R / E:.0e} E/R]", depth, "mm", 0.0, "non-penetration, eq. (5)"
    )
    scene.result(f"algebraic_error[penalty={stiffness * R / E:.0e} E/R]", error, "1")
    scene.result(f"newton_steps[penalty={stiffness * R / E:.0e} E/R]", answer.steps, "1")

# %% [markdown]
# ## With friction: mu = 0.5, ten load steps
#
# Error against the finest mesh of this part; all corrections follow the same path.

# %%
paths = {
    "none": [1],
    "direct": range(1, 4 if scene.quick else 6),
    "multigrid": range(1, 4 if scene.quick else 6),
    "algebraic": range(1, 4 if scene.quick else 5),
}
compiling = cylinder(1, "platen", mu).problem
for name in paths:
    solve(compiling, name, tolerance=1e-2, progress=False)
peak, friction_seconds, steps = {}, {name: {} for name in paths}, 2 if scene.quick else 10
for k in scene.progress(paths["multigrid"], "with friction"):
    rubbing = cylinder(k, "platen", mu)
    for name in (name for name in paths if k in paths[name]):
        began = perf_counter()
        solver = ContactSolver(rubbing.problem, name, progress=False)
        path = list(
            follow(solver, [rubbing.problem.b * (s / steps) for s in range(1, steps + 1)], tolerance=1e-8)
        )
        friction_seconds[name][k] = perf_counter() - began
        if name == "multigrid":
            peak[k] = rubbing.pressure(path[-1]).max()
            dofs = rubbing.problem.b.size
            scene.result(f"cycles_per_step[mu=0.5, dofs={dofs}]", max(s.cycles for s in path), "V(1,1)")
        scene.result(
            f"seconds[mu=0.5, {name}, dofs={rubbing.problem.b.size}]", friction_seconds[name][k], "s"
        )
peak_error = {k: abs(peak[k] / peak[max(peak)] - 1) for k in peak if k < max(peak)}

# %% [markdown]
# ## Figures

# %%
k = 3 if scene.quick else 5
curves = {"multigrid": ([h[0] for h in histories[k]], [h[2] for h in histories[k]])}
for name in seconds:
    if name != "multigrid" and k in seconds[name]:
        curves[name] = ([seconds[name][k]], [reached[name, k]])
if k == 3:
    curves["penalty form"] = tuple(zip(*penalised.values(), strict=True))
figure = convergence_figure(
    {name: np.array(c[0]) for name, c in curves.items()},
    {name: np.maximum(c[1], 1e-14) for name, c in curves.items()},
    f"seconds, set-up included ({found[k]['dofs']} unknowns)",
    "algebraic error (energy norm, relative)",
    floors={"discretisation error": errors["energy"][k]},
)
scene.figure(figure, "algebraic_error")

labels = {
    "p0": "peak pressure",
    "a": "half width",
    "pressure": "pressure (L2)",
    "energy": "displacement (energy norm)",
}
figure, panels = plt.subplots(2, 2, figsize=(9.6, 7.2), layout="constrained", sharex=True)
for axes, (quantity, label) in zip(panels.flat, labels.items(), strict=True):
    for look, (name, times) in zip(LOOKS, seconds.items(), strict=False):
        common = [k for k in levels if k < levels[-1] and k in times]
        axes.loglog(
            [times[k] for k in common],
            [errors[quantity][k] for k in common],
            label=name,
            markerfacecolor="none",
            **look,
        )
    axes.set(
        title=label, xlabel="seconds, set-up included", ylabel="error against the mesh-converged solution"
    )
    axes.grid(color="0.9")
panels[0, 0].axhline(
    abs(hertz.p0 / converged["p0"] - 1),
    color="0.5",
    linestyle=":",
    label="error of Hertz's half-space theory",
)
panels[0, 1].axhline(abs(hertz.a / converged["a"] - 1), color="0.5", linestyle=":")
panels[0, 0].legend(frameon=False, fontsize="x-small")
scene.figure(figure, "error_against_run_time")

every = {name: [k for k in levels if k in seconds[name]] for name in seconds}
figure = convergence_figure(
    {name: np.array([found[k]["dofs"] for k in ks]) for name, ks in every.items()},
    {name: np.array([1e6 * seconds[name][k] / found[k]["dofs"] for k in ks]) for name, ks in every.items()},
    "unknowns",
    "microseconds per unknown, to 1e-8",
)
scene.figure(figure, "seconds_per_unknown")
figure = convergence_figure(
    np.array([found[k]["dofs"] for k in levels]),
    {
        "V(1,1) cycles to 1e-8": np.array([found[k]["cycles"] for k in levels]),
        "work units to discretisation accuracy": np.array([units_to_accuracy[k] for k in levels]),
    },
    "unknowns",
    "multigrid",
)
scene.figure(figure, "cycles")
figure = convergence_figure(
    {
        name: np.array([friction_seconds[name][k] for k in peak_error if k in friction_seconds[name]])
        for name in paths
    },
    {name: np.array([peak_error[k] for k in peak_error if k in friction_seconds[name]]) for name in paths},
    f"seconds, {steps} load steps, mu = 0.5",
    "error of p0 against the finest mesh",
)
scene.figure(figure, "friction")

# %%
last = max(scenes)
scenes[last].problem.save(scene.out / "problem.npz", exact[last])
scenes[last].write(scene.out / "hertz.xdmf", exact[last])
scene.finish(
    dofs=finest["dofs"],
    contact_candidates=finest["candidates"],
    sweeps=finest["sweeps"],
    cycles=finest["cycles"],
    work_units=finest["work_units"],
    solve_seconds=finest["seconds"],
    residual=finest["residual"],
)
