# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Normal loading: the loop as printed, load steps, meshes, and Hertz's own error
#
# What `section_3_1_1_normal_loading.py` leaves open. Four questions: what does the loop need without a correction,
# how does the answer converge with the number of load steps, how with the mesh, and how far is the elastic
# half cylinder from the half space?

# %%
from time import process_time

import numpy as np
from bodies import NU, E, P, R, cylinder, order_of
from harness.readings import read_patch
from harness.scene import Scene

from geometry import half_cylinder, half_cylinder_nested
from model import ContactSolver, follow, solve
from model.closed_forms.hertz import HertzCylinder
from model.closed_forms.spence import Spence
from model.figures.figures import convergence_figure
from model.results.pressure import line_error

scene = Scene(
    "normal_loading_refinement", "The cylinder of section 3.1.1: loop, load steps, meshes, half space."
)
scene.built("K")
scene.left_out("M", "C", "gmsh", "pyvista")
cylinder = scene.assembly(cylinder)
mu, hertz = 0.5, HertzCylinder(P, R, E, NU)

# %% [markdown]
# ## The loop as printed, on the paper's mesh
#
# Relaxation removes short waves at once and long ones hardly at all. Under a platen, whose nodes fall together,
# the loop needs tens of thousands of sweeps; under a uniform traction, where the body must turn and fall node
# by node, more than a million (`error_against_run_time.py` counts them). Stopping early is no remedy: a
# small increment is not a small error.

# %%
pressed = cylinder(loading="platen", grid=half_cylinder(R))
direct = solve(pressed.problem, "direct", tolerance=1e-12)
relaxed = solve(pressed.problem, "none", tolerance=1e-11, limit=30_000)
direct_p0, relaxed_p0 = (pressed.pressure(answer).max() for answer in (direct, relaxed))
scene.result("p0[mu=0, platen]", direct_p0, "MPa", hertz.p0, "Hertz, eq. (13)")
scene.result("sweeps[correction=none]", relaxed.sweeps, "1")
scene.result("seconds[correction=none]", relaxed.seconds, "s", direct.seconds, "direct, this run")
scene.result("error_p0[correction=none]", abs(relaxed_p0 / direct_p0 - 1), "1", 0.0, "direct, this run")
again = ContactSolver(pressed.problem, "none", progress=False)
began = process_time()  # of this core: the machine may be shared
swept = again.solve(tolerance=1e-3, limit=30_000)
rate = swept.sweeps * len(swept.displacement) / (process_time() - began)
scene.result("node_updates_per_second", rate, "1/s", 15e6, "wanted", "at least")

# %% [markdown]
# ## Load steps, mu = 0.5
#
# Within a step a node sticks where it was at the end of the last one: first order in the step.

# %%
spence = Spence(hertz, mu)
rubbing = cylinder(loading="platen", friction=mu, grid=half_cylinder(R))
peaks, widths = [], []
for count in scene.progress((10, 20) if scene.quick else (10, 20, 40, 80), "steps"):
    loads = [rubbing.problem.b * (k / count) for k in range(1, count + 1)]
    *_, last = follow(ContactSolver(rubbing.problem, "direct"), loads, tolerance=1e-12)
    patch = read_patch(rubbing, last, degree=2)
    peaks.append(patch.p.max())
    widths.append(patch.width.interpolated)
    scene.result(f"p0[mu=0.5, steps={count}]", peaks[-1], "MPa")
    scene.result(f"a[mu=0.5, steps={count}]", widths[-1], "mm")
source = "extrapolated; Spence, half plane"
scene.result("p0[mu=0.5, steps=limit]", 2 * peaks[-1] - peaks[-2], "MPa", spence.p0, source)
scene.result("a[mu=0.5, steps=limit]", 2 * widths[-1] - widths[-2], "mm", spence.a, source)

# %% [markdown]
# ## Meshes
#
# Nested meshes of 56 x 4^k quadrilaterals, both ways of loading. Errors are measured against the
# mesh-converged value of the same problem (Richardson from the two finest meshes); Hertz's own model error is
# the distance of that from eq. (13), drawn as a line.

# %%
levels = range(1, 5) if scene.quick else range(1, 7)
h = 0.5 / 2.0 ** np.array(levels)[:-1]  # node spacing under the contact, mm
errors, seconds, limits = {}, {}, {}
for loading in ("uniform", "platen"):
    patches, spent = [], []
    for k in scene.progress(levels, f"meshes, {loading}"):
        pressed = cylinder(k, loading)
        solution = solve(pressed.problem, "multigrid", tolerance=1e-10)
        patches.append(read_patch(pressed, solution))
        spent.append(solution.seconds + solution.setup_seconds)
    p0 = np.array([patch.p.max() for patch in patches])
    limits[loading] = p0[-1] + (p0[-1] - p0[-2]) / 3
    finest = patches.pop()
    exact = lambda s, finest=finest: np.interp(s, finest.x, finest.p)  # noqa: E731
    for name, values in {
        "p0": np.abs(p0[:-1] / limits[loading] - 1),
        "a": [abs(patch.width.interpolated / finest.width.interpolated - 1) for patch in patches],
        "pressure (L2)": [line_error(patch.x, patch.p, exact) for patch in patches],
    }.items():
        errors[f"{name}, {loading}"] = np.maximum(values, 1e-7)
        seconds[f"{name}, {loading}"] = np.array(spent[:-1])
    scene.result(f"p0[mesh-converged, {loading}]", limits[loading], "MPa", hertz.p0, "Hertz, eq. (13)")
scene.result("order_p0", order_of(h, errors["p0, uniform"]), "1")
scene.result("order_pressure_L2", order_of(h, errors["pressure (L2), uniform"]), "1")
floor = {"half-space theory against the elastic body, p0": abs(hertz.p0 / limits["uniform"] - 1)}
label = "error against the mesh-converged value (relative)"
scene.figure(convergence_figure(h, errors, "node spacing h (mm)", label, floors=floor), "refinement_h")
picture = convergence_figure(seconds, errors, "seconds, set-up included", label, floors=floor)
scene.figure(picture, "refinement_run_time")

# %% [markdown]
# ## The half space
#
# Hertz's model error is one of geometry, a/R = 0.074 here; it sinks with the load. The inner block of the
# mesh shrinks with the patch, so that each load is resolved alike.

# %%
parts, floor = (1.0, 0.1) if scene.quick else (1.0, 0.1, 0.01, 0.001), []
for part in scene.progress(parts, "loads"):
    grid = half_cylinder_nested(R, inner_half_width=0.1 * R * np.sqrt(part))
    lighter = [cylinder(k, force=part * P, grid=grid) for k in (3, 4)]
    coarse, fine = (s.pressure(solve(s.problem, "multigrid", tolerance=1e-10)).max() for s in lighter)
    floor.append(abs((fine + (fine - coarse) / 3) / HertzCylinder(part * P, R, E, NU).p0 - 1))
    scene.result(f"hertz_model_error[load={part:g}]", floor[-1], "1", 0.0, "p0 against eq. (13)")
sizes = np.array([HertzCylinder(part * P, R, E, NU).a / R for part in parts])
picture = convergence_figure(sizes, {"p0": np.array(floor)}, "a/R", "p0 against Hertz (relative)")
scene.figure(picture, "hertz_model_error")

# %%
scene.finish(solution)
