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
from bodies import NU, E, P, R, ball, cylinder
from competitors import ORDERINGS, snes, tao
from harness.machine import machine, triad_bandwidth
from harness.readings import read_patch
from harness.scene import Scene
from impact import strike_apart
from kernels import kernel_seconds
from scipy.sparse import csc_array
from weak_contact import Pressed, latent_variable, nitsche, penalty

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, box, half_ball, half_cylinder, half_cylinder_gmsh, half_cylinder_nested
from model import BodyOnRoad, ContactSolver, NotConverged, Status, follow, solve
from model.closed_forms.hertz import HertzCylinder
from model.figures.figures import STYLES, convergence_figure
from model.solvers.factorisation import factorised

scene = Scene(
    "error_against_run_time", "Error against run time: this project's corrections and what else there is."
)
scene.built("K", "M")
scene.left_out("C", "pyvista")
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


def bytes_of_a_cycle(problem):
    """What one cycle of conjugate gradients must move: matrices, transfers and vectors, each once a use.

    As cycles are usually written: here the last sweep of a cycle leaves its defect, which spares the third
    product with the finest matrix, but it stays counted.
    """
    levels = ContactSolver(problem, "multigrid", progress=False).correction.cycle.levels
    moved = 0
    for number, level in enumerate(levels[:-1]):
        A, P, vector = level.A, level.P, 8 * level.inverse.shape[0] * level.inverse.shape[1]
        products = 3 if number == 0 else 2  # two sweeps, and on the finest mesh A times the direction
        moved += products * (A.data.nbytes + A.indices.nbytes) + 2 * (level.inverse.nbytes + P.data.nbytes)
        moved += (8 if number else 16) * vector
    return moved


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
        "cycle": bytes_of_a_cycle(problem),
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
    per_cycle = f["cycle"] / f["dofs"]
    scene.result(f"bytes_per_unknown_and_cycle[dofs={f['dofs']}]", per_cycle, "bytes", None, "V(1,1)")
    ratio = f["seconds"] * triad / (f["cycles"] * f["cycle"])
    note = "wanted; seconds over what the cycles must move, at triad's speed"
    scene.result(f"bandwidth_ratio[dofs={f['dofs']}]", ratio, "1", 2.5, note, "at most")
scene.result("peak_memory_per_dof", memory / finest["dofs"], "bytes")
for name, contact in (
    {"plane": cylinder(2), "space": ball("quarter", 1, 15e3)}
    if scene.quick
    else {"plane": cylinder(6), "space": ball("quarter", 3, 15e3)}
).items():
    kernels, moved = kernel_seconds(contact.problem)
    for kernel, spent in kernels.items():
        key = f"bandwidth[{kernel}, {name}, dofs={contact.problem.b.size}]"
        scene.result(key, moved / spent / triad, "of triad", 1.0, "A, u, load and defect moved once")
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
for name in list(others)[3:]:
    for k, theirs in seconds[name].items():
        scene.result(f"speedup[{name}, dofs={found[k]['dofs']}]", theirs / found[k]["seconds"], "1")
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
# ## Forms of contact in UFL
#
# Penalty at three stiffnesses, Nitsche's form with semismooth Newton steps (the augmented Lagrangian with its
# multiplier eliminated), and the latent variable proximal point method, in which the gap is $e^\psi$. Contact holds
# in a weak sense: what each leaves shows as penetration of the nodes. All linear solves are MUMPS's.


# %%
def weak_answers(name, pressed, start, size, alpha, exact_u, A):
    """Run all of them on one scene; note seconds, linear solves, penetration and error in the energy norm."""
    body = pressed.elasticity.body
    young = pressed.elasticity.materials[0].E
    methods = {f"penalty={c:.0e} E/R": (penalty, c * young / size) for c in (1e2, 1e4, 1e6)}
    methods |= {"Nitsche": (nitsche, 1e4 * young / size)}
    told = {}
    for method, (run, parameter) in methods.items():
        told[method] = lambda run=run, parameter=parameter: run(pressed, parameter, start)
    told["latent variable"] = lambda: latent_variable(pressed, alpha)
    found = {}
    for method, run in told.items():
        key = f"{method}, {name}, dofs={start.size}"
        try:
            run()  # compiles
            answer = run()
        except RuntimeError as error:
            print(f"{key}: {error}")
            scene.result(f"did_not_converge[{key}]", 1, "1", 0)
            continue
        if method == "latent variable":
            answer, rounds = answer
            scene.result(f"proximal_steps[{name}, dofs={start.size}]", rounds, "1")
        u = answer.displacement
        depth = -(body.coordinates + u)[body.nodes(pressed.boundary), body.dim - 1].min()
        e, x = (u - exact_u).ravel(), exact_u.ravel()
        error = np.sqrt(max(e @ (A @ e), 0.0) / (x @ (A @ x)))
        found[method] = (answer.seconds, error)
        scene.result(f"seconds[{key}]", answer.seconds, "s")
        scene.result(f"linear_solves[{key}]", answer.steps, "1")
        scene.result(f"penetration[{key}]", max(depth, 0.0), "length", 0.0, "non-penetration, eq. (5)")
        scene.result(f"algebraic_error[{key}]", error, "1", None, "nodal and weak contact differ by more")
    return found


k = 3
whole = scenes[k].elasticity
pressed = Pressed(
    whole, whole.total_force("top", (0.0, -P)), "arc", np.array([2 * whole.body.nearest_node((0.0, R))])
)
penalised = weak_answers("cylinder", pressed, start[k], R, 1e-4, exact[k].displacement, scenes[k].problem.A)

# %% [markdown]
# The unit cube pressed by 0.25 on a plane, on which the latent variable method was published as a script: E = 2e4,
# nu = 0.3, alpha from 0.005 doubling, 16 x 7 x 5 hexahedra; 2 proximal steps and 6 linear solves.

# %%
grid = box(1.0, 1.0, 1.0, *((4, 3, 2) if scene.quick else (16, 7, 5)))
cube = Elasticity(Body.from_grid(grid), Isotropic(2e4, 0.3))
top, nothing = cube.body.nodes("top"), np.zeros_like(cube.body.coordinates)
support = Support(cube.body).fix("top", x=0.0, y=0.0, z=-0.25)
cube_problem = BodyOnRoad(cube.system(nothing, support), "bottom", Plane((0, 0, 0), (0, 0, 1))).problem
cube_seconds, cube_exact = timed(cube_problem, "auto", 1e-10)
scene.result(f"seconds[this code, cube, dofs={nothing.size}]", cube_seconds, "s")
pressed = Pressed(
    cube, nothing, "bottom", (3 * top[:, None] + np.arange(3)).ravel(), np.tile([0, 0, -0.25], len(top))
)
guess = np.zeros_like(nothing)
weak_answers("cube", pressed, guess, 1.0, 0.005, cube_exact.displacement, cube_problem.A)

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
# ## In space: a ball under a platen, without and with friction

# %%
part_loads = (0.0, 0.25, 0.5, 0.75, 0.95)
for k in scene.progress(range(1, 2 if scene.quick else 5), "in space"):
    round_body = ball("quarter", k, 15e3).problem
    dofs = round_body.b.size
    spent, solution = timed(round_body, "multigrid", 1e-8)
    scene.result(f"cycles[sphere, dofs={dofs}]", solution.cycles, "V(1,1)", 16, "wanted", "at most")
    scene.result(f"seconds[multigrid, sphere, dofs={dofs}]", spent, "s")
    ratio = spent * triad / (solution.cycles * bytes_of_a_cycle(round_body))
    scene.result(f"bandwidth_ratio[sphere, dofs={dofs}]", ratio, "1", 2.5, "wanted", "at most")
    if k > 3:
        continue
    guess = np.zeros_like(round_body.b)
    guess[:, 2] = -0.05
    others_in_space = {"vinewtonrsls + CG/GAMG": (snes, "vinewtonrsls"), "GPCG + CG/GAMG": (tao, "gpcg")}
    fast = {}
    for name, (method, kind) in others_in_space.items():
        try:
            fast[name] = method(round_body, kind, "gamg", guess).seconds
        except RuntimeError as error:
            print(f"{name} on {dofs} unknowns: {error}")
            scene.result(f"did_not_converge[{name}, sphere, dofs={dofs}]", 1, "1", 0)
    if k < 3:
        fast["vinewtonrsls + MUMPS"] = snes(round_body, "vinewtonrsls", "mumps", guess).seconds
    for name, theirs in fast.items():
        scene.result(f"speedup[{name}, sphere, dofs={dofs}]", theirs / spent, "1")
    quickest = min(fast, key=fast.get)
    wanted = (50.0, f"wanted at 130,000; {quickest}", "at least") if dofs > 100_000 else ()
    scene.result(f"speedup_in_space[dofs={dofs}]", fast[quickest] / spent, "1", *wanted)

for k in range(1, 2 if scene.quick else 4):
    rubbing = ball("half", k, 15e3, mu)
    body = rubbing.elasticity.body
    pushes = [
        rubbing.system.reduce(rubbing.elasticity.total_force("top", 7.5e3 * np.array([Q * mu, 0.0, -1.0])))
        for Q in part_loads
    ]
    solver = ContactSolver(rubbing.problem, "multigrid", progress=False)
    for Q, step in zip(part_loads, follow(solver, pushes, tolerance=1e-8), strict=True):
        key = f"cycles[friction, Q={Q} mu F, dofs={rubbing.problem.b.size}]"
        scene.result(key, step.cycles, "V(1,1)", 16, "wanted", "at most")

# %% [markdown]
# ## The others with friction, in the plane and in space
#
# A top that is lowered by 0.05 mm, then moved along the road by 0.01 and 0.02 mm, mu = 0.5: stick in the middle, slip
# around it. The penalty form holds nodes that stick by springs; Nitsche's form cuts the whole traction to the friction
# disc. Both take semismooth Newton steps by MUMPS, shortened where the residual would rise.


# %%
def lowered_and_moved(dim, k):
    """Forms, contact problem, loads of three steps, and the same as prescribed unknowns and their values."""
    grid, boundary = ((half_cylinder_nested(R), "arc"), (half_ball(R, "half"), "sphere"))[dim - 2]
    body, road = Body.from_grid(grid, k), Plane(np.zeros(dim), np.eye(dim)[-1])
    elasticity, top, loads, values = Elasticity(body, Isotropic(E, NU)), body.nodes("top"), [], []
    for moved in (0.0, 0.01, 0.02):
        support = Support(body) if dim == 2 else Support(body).fix("y0", y=0.0)
        place = dict(zip("xyz", (moved, *[0.0] * (dim - 2), -0.05)))
        system = elasticity.system(np.zeros_like(body.coordinates), support.fix("top", **place))
        rubbing = BodyOnRoad(system, boundary, road, friction=mu, reach=0.2 * R)
        loads.append(rubbing.problem.b)
        prescribed = np.zeros_like(body.coordinates)
        prescribed[top] = list(place.values())
        values.append(prescribed[system.fixed])
    return rubbing, loads, np.flatnonzero(system.fixed), values


for dim, k in ((2, 1), (3, 0)) if scene.quick else ((2, 3), (2, 4), (3, 1)):
    rubbing, loads, fixed, values = lowered_and_moved(dim, k)
    A, dofs, runs = rubbing.problem.A, loads[0].size, []
    for _ in range(2):
        began = perf_counter()
        solver = ContactSolver(rubbing.problem, "auto", progress=False)
        last = list(follow(solver, loads, tolerance=1e-8))[-1].displacement
        runs.append(perf_counter() - began)
    scene.result(f"seconds[this code, friction, dofs={dofs}]", min(runs), "s")
    x = list(follow(ContactSolver(rubbing.problem, "direct"), loads, tolerance=1e-11))[
        -1
    ].displacement.ravel()
    e = last.ravel() - x
    scene.result(
        f"algebraic_error[this code, friction, dofs={dofs}]", np.sqrt((e @ (A @ e)) / (x @ (A @ x))), "1"
    )
    boundary = "arc" if dim == 2 else "sphere"
    pressed = Pressed(rubbing.elasticity, np.zeros_like(last), boundary, fixed, friction=mu)
    guess = np.zeros_like(last)
    guess[:, -1] = -0.05
    methods = {f"penalty={c:.0e} E/R": (penalty, c) for c in (1e2, 1e3, 1e4)}
    methods |= {f"Nitsche={c:.0e} E/R": (nitsche, c) for c in (1e2, 1e3, 1e4)}
    for method, (run, c) in methods.items():
        key = f"{method}, friction, dofs={dofs}"
        try:
            run(pressed, c * E / R, guess, values[:1])  # compiles
            answer = run(pressed, c * E / R, guess, values)
        except RuntimeError as error:
            print(f"{key}: {error}")
            scene.result(f"did_not_converge[{key}]", 1, "1", 0)
            continue
        e = answer.displacement.ravel() - x
        scene.result(f"seconds[{key}]", answer.seconds, "s")
        scene.result(f"linear_solves[{key}]", answer.steps, "1")
        scene.result(f"algebraic_error[{key}]", np.sqrt((e @ (A @ e)) / (x @ (A @ x))), "1")
        scene.result(f"speedup[{key}]", answer.seconds / min(runs), "1")

# %% [markdown]
# ## In time: a ball strikes the road
#
# Mass redistribution, steps in which waves pass two cells, each step to 1e-8; V(2,2) cycles. Each run is a process
# of its own.

# %%
for k, steps in ((1, 10), (2, 10)) if scene.quick else ((2, 20), (3, 20), (4, 10)):
    struck = strike_apart(k, steps, "multigrid")
    dofs = struck["dofs"]
    scene.result(
        f"cycles_per_step[time, dofs={dofs}]", struck["cycles"], "V(2,2), median", 4, "wanted", "at most"
    )
    scene.result(f"most_cycles_of_a_step[time, dofs={dofs}]", struck["worst"], "V(2,2)")
    scene.result(f"seconds_per_step[time, multigrid, dofs={dofs}]", struck["seconds"], "s")
    scene.result(f"setup_seconds[time, multigrid, dofs={dofs}]", struck["setup_seconds"], "s")
    if k < 4:
        exactly = strike_apart(k, 10, "direct")
        scene.result(f"seconds_per_step[time, direct, dofs={dofs}]", exactly["seconds"], "s")
        scene.result(f"setup_seconds[time, direct, dofs={dofs}]", exactly["setup_seconds"], "s")
    else:
        scene.result(f"peak_memory[time, dofs={dofs}]", struck["GiB"], "GiB", 4, "wanted", "at most")

# %% [markdown]
# ## Any mesh: aggregates on triangles and tetrahedra, and one factorisation


# %%
def on_triangles(spacing):
    """Half cylinder on triangles of gmsh."""
    return cylinder(
        grid=half_cylinder_gmsh(R, spacing=spacing, largest=10 * spacing, cell="triangle"), reach=2.0
    )


def on_tetrahedra(cells, nu):
    """A cube of rubber under a platen, on tetrahedra."""
    elasticity = Elasticity(
        Body.from_grid(box(1.0, 1.0, 1.0, *[cells] * 3, cell="tetrahedron")), Isotropic(5.0, nu)
    )
    support = Support(elasticity.body).platen("top").fix("top", x=0.0, y=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, 0.0, -0.3)), support)
    return BodyOnRoad(system, "bottom", Plane((0, 0, 0), (0, 0, 1)))


meshes = {f"triangles, h={h}": on_triangles(h) for h in ((0.16,) if scene.quick else (0.16, 0.08, 0.04))}
for nu in (0.3, 0.45):
    for cells in (4,) if scene.quick else (6, 12, 18):
        meshes[f"tetrahedra, nu={nu}, n={cells}"] = on_tetrahedra(cells, nu)
for name, contact in meshes.items():
    _, solution = timed(contact.problem, "algebraic", 1e-8, 1)
    key = f"cycles[algebraic, mesh={name}, dofs={contact.problem.b.size}]"
    scene.result(key, solution.cycles, "W(1,1)" if "triangles" in name else "V(2,2)", 25, "wanted", "at most")
for k in large_ones:
    matrix, began = csc_array(scenes[k].problem.A), perf_counter()
    factor = factorised(matrix)
    for _ in range(20):
        factor.solve(np.ones(matrix.shape[0]))
    ratio = seconds["direct"][k] / (perf_counter() - began)
    key = f"direct_over_factorisation[dofs={found[k]['dofs']}]"
    scene.result(key, ratio, "1", 2, "wanted; a factorisation and 20 back-substitutions", "at most")

# %% [markdown]
# ## Figures

# %%
k = 3 if scene.quick else 5
curves = {"multigrid": ([h[0] for h in histories[k]], [h[2] for h in histories[k]])}
for name in seconds:
    if name != "multigrid" and k in seconds[name]:
        curves[name] = ([seconds[name][k]], [reached[name, k]])
if k == 3:
    curves["forms in UFL"] = tuple(zip(*penalised.values(), strict=True))
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
    for style, (name, times) in zip(STYLES, seconds.items(), strict=False):
        common = [k for k in levels if k < levels[-1] and k in times]
        axes.loglog(
            [times[k] for k in common],
            [errors[quantity][k] for k in common],
            label=name,
            markerfacecolor="none",
            **style,
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
every = {name: ks for name, ks in every.items() if ks}
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
