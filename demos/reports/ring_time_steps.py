# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # The bouncing ring: smaller steps, finer meshes, error against run time, and what contact costs
#
# Without friction the energy is known; the height of A is compared every 0.01 s (root mean square over 1 s, and
# at its end) with contact-stabilised Newmark on the finest mesh with half the finest dt. Plain Newmark does not
# converge on a given mesh: once dt is shorter than a wave takes through one element (1.4 ms on the coarsest mesh),
# the held node, which keeps its speed, is let go and touches again every few steps, each time with a kick, and
# the energy grows. The stabilised schemes converge, at least with the first order of their contact force; on the
# coarser meshes the height ends at what the mesh is off by.

# %%
import warnings

import numpy as np
from bodies import KINETIC, launched_ring
from harness.linear_cost import beside_linear, run_seconds
from harness.motion import recorded
from harness.scene import Scene

from model import ContactStabilised, Newmark, UnresolvedWaves
from model.dynamics.schemes import IMPLICIT
from model.figures.figures import convergence_figure
from model.recording.energy_balance import total_energy

scene = Scene("ring_time_steps", "The bouncing ring: smaller steps, finer meshes, and what contact costs.")
scene.built("M", "K").left_out("C", "gmsh", "pyvista")
warnings.simplefilter("ignore", UnresolvedWaves)  # that is what is studied
launched_ring = scene.assembly(launched_ring)
STABILISED = list(IMPLICIT)[3:]


# %%
def run(name, moving, velocity, dt):
    """Run for 1 s without friction; return heights of A, what became of the energy, and run time."""
    scheme, A = IMPLICIT[name](moving, dt), np.argmin(moving.coordinates[:, 1])
    state = scheme.start(velocity=velocity)
    heights, seconds, before = [], scheme.setup_seconds, total_energy(scheme, state)
    for _ in range(100):
        spent, state = run_seconds(scheme, state, round(0.01 / dt))
        seconds += spent
        heights.append(state.displacement[A, 1])
    return np.array(heights), abs(total_energy(scheme, state) - before) / KINETIC, seconds


steps = (0.01, 0.005, 0.0025) if scene.quick else (0.01, 0.005, 0.0025, 0.00125, 0.000625)
rings = [launched_ring(refinements=level) for level in ((0,) if scene.quick else (0, 1, 2))]
reference, *_ = run("contact-stabilised", *rings[-1][2:], steps[-1] / 2)
scene.result("u_y(A)[t=1,reference]", reference[-1], "m", None, "contact-stabilised, finest")
errors, seconds, last = {"energy": {}, "height of A": {}}, {}, {}
for body, _, moving, velocity in rings:
    for name in IMPLICIT if body is not rings[-1][0] or scene.quick else ["Newmark", *STABILISED]:
        label = f"{name}, {len(body.cells)} quads"
        found = [run(name, moving, velocity, dt) for dt in scene.progress(steps, label)]
        errors["energy"][label], seconds[label] = ([values[k] for values in found] for k in (1, 2))
        errors["height of A"][label] = [np.sqrt(np.mean((u - reference) ** 2)) for u, *_ in found]
        last.setdefault(name, []).append(found[-1][0])
        off = abs(found[-1][0][-1] - reference[-1])
        scene.result(f"error_of_u_y(A)_at_1_s[{label},dt={steps[-1]:g}]", off, "m", 0.0)
for (what, lines), unit in zip(errors.items(), ("of the kinetic energy", "m")):
    key, title = what.replace(" ", "_"), f"error of the {what} ({unit})"
    for label, values in lines.items():
        order, known = np.log(values[0] / values[-1]) / np.log(steps[0] / steps[-1]), label.split(",")[0]
        converges = known in STABILISED and (what == "energy" or label.endswith(f", {len(body.cells)} quads"))
        expected = (1.0, "of the contact force") if converges else (None, None)
        scene.result(f"order_of_{key}[{label}]", order, "1, in dt", *expected)
        scene.result(f"error_of_{key}[{label},dt={steps[-1]:g}]", values[-1], unit, 0.0)
    coarse = {name.split(",")[0]: values for name, values in lines.items() if "576" in name}
    meshes = {name: values for name, values in lines.items() if name.split(",")[0] in STABILISED}
    times = {name: seconds[f"{name}, 576 quads"] for name in coarse}
    scene.figure(convergence_figure(np.array(steps), coarse, "dt (s)", title, 1.0), f"{key}_against_dt")
    scene.figure(convergence_figure(times, coarse, "run time (s)", title), f"{key}_against_run_time")
    scene.figure(convergence_figure(seconds, meshes, "run time (s)", title), f"{key}_against_run_time_meshes")

if not scene.quick:
    for name in STABILISED:
        coarser, finer = (np.linalg.norm(step) for step in np.diff(last[name], axis=0))
        key = f"order_in_h_of_height_of_A[{name},dt={steps[-1]:g}]"
        scene.result(key, np.log2(coarser / finer), "1, in h", None, "three meshes")
    for mu in (0.0, 0.1):  # where the second touches converge to
        _, _, moving, velocity = launched_ring(mu or None, refinements=1)
        fine = recorded(ContactStabilised(moving, 0.000625), velocity, 1700, {})
        how = "contact-stabilised, 2,304 quads, dt = 0.625 ms"
        scene.result(f"second_touch[mu={mu:g},converged]", fine.bounces(apart=0.05)[1][0], "s", None, how)

# %% [markdown]
# ## What contact costs
#
# A run without contact would take one factorisation and one back-substitution a step. The plain loop
# (correction "none") has only its relaxation; here it takes the steps from 0.3 s on to the same residual.

# %%
body, _, moving, velocity = launched_ring(0.1)
ratios = []
for _ in range(3):
    scheme = Newmark(moving, 0.01)
    first = scheme.start(velocity=velocity)
    taken, factorisation, linear = beside_linear(scheme, first, 100)
    ratios.append((scheme.setup_seconds + taken.sum()) / (factorisation + linear.sum()))
scene.result("cost_ratio_to_linear_steps", min(ratios), "1", 3.0, "100 steps, set-up included", "at most")
flying = scheme.run(first, 30)
count = 8 if scene.quick else 100
quick_seconds = min(run_seconds(scheme, flying, count)[0] for _ in range(3))
slow_seconds, _ = run_seconds(Newmark(moving, 0.01, correction="none"), flying, count)
scene.result("speedup_over_loop", slow_seconds / quick_seconds, "1", 20.0, "the plain loop", "at least")
whole = recorded(Newmark(moving, 0.01), velocity, 130, {})
if not scene.quick:
    _, _, moving, velocity = launched_ring(0.1, around=640, across=77)
    scheme = Newmark(moving, 0.001)
    first = scheme.start(velocity=velocity)
    taken, factorisation, linear = beside_linear(scheme, first, 1000, every=10)
    ratio = (scheme.setup_seconds + taken.sum()) / (factorisation + 10 * linear.sum())
    key = f"dofs={moving.coordinates.size}"
    scene.result(f"cost_ratio_to_linear_steps[{key}]", ratio, "1", 3.0, "1,000 steps", "at most")
    early = np.median(taken[:250]) / np.median(linear[:25])
    late = np.median(taken[-250:]) / np.median(linear[-25:])
    scene.result(f"late_steps_over_early_steps[{key}]", late / early, "1", 1.0, "both in flight")

# %%
scene.finish(whole)
