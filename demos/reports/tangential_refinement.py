# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Cattaneo and Mindlin, mesh by mesh
#
# The uncoupled variant of section 3.1.2 (P laid on without friction, nu = 0.49, then Q = 0.75 mu P in ten steps)
# on finer and finer meshes. What stays is the roundness of the body: its turning moves the patch by 0.01 mm, so x is
# counted from the middle of the patch.

# %%
from dataclasses import replace

import numpy as np
from bodies import E, P, R, cylinder
from harness.readings import read_patch
from harness.scene import Scene

from geometry import half_cylinder, half_cylinder_nested
from model import ContactSolver, Status, follow, solve
from model.closed_forms.hertz import HertzCylinder
from model.closed_forms.mindlin import MindlinCylinder
from model.figures.figures import convergence_figure, stick_slip_figure
from model.results.pressure import contact_half_width, line_error

scene = Scene("tangential_refinement", "Cattaneo and Mindlin's stick zone and traction, mesh by mesh.")
scene.built("K").left_out("M", "C", "gmsh", "pyvista")
cylinder = scene.assembly(cylinder)
mu = 0.5
Q = 0.75 * mu * P
hertz = HertzCylinder(P, R, E, nu=0.49)
mindlin = MindlinCylinder(hertz, Q, mu)

# %%
meshes = {"760 quads": (half_cylinder(R), 0)}
meshes |= {f"{56 * 4**k} quads": (half_cylinder_nested(R), k) for k in ((3,) if scene.quick else (3, 4, 5))}
spacings, errors = [], {"c / a": [], "tau (L2)": []}
for name, (grid, refinements) in scene.progress(meshes.items(), "meshes"):
    options = {"loading": "platen", "grid": grid, "nu": 0.49}
    smooth = cylinder(refinements, **options)
    rough = cylinder(refinements, friction=mu, held=False, **options)
    pull = rough.system.reduce(rough.elasticity.total_force("top", (Q, 0.0)))
    laid_on = solve(smooth.problem, "direct").displacement[rough.problem.contact_nodes]
    problem = replace(rough.problem, tangential_reference=laid_on)
    loads = [problem.b + pull * (k / 10) for k in range(1, 11)]
    *_, last = follow(ContactSolver(problem, "direct"), loads)
    patch = read_patch(rough, last)
    x = patch.x - patch.width.centre
    zone = contact_half_width(x, mu * patch.p - abs(patch.tau), patch.status == Status.STICK)
    spacings.append(np.diff(x)[x.size // 2])
    errors["tau (L2)"].append(line_error(x, abs(patch.tau), mindlin.traction))
    errors["c / a"].append(abs(zone.interpolated / hertz.a / 0.5 - 1))
    scene.result(f"c_over_a[uncoupled, {name}]", zone.interpolated / hertz.a, "1", 0.5, "eq. (15)")
    scene.result(f"tau_L2_error[uncoupled, {name}]", errors["tau (L2)"][-1], "1", 0.0, "eq. (14)")
    scene.result(f"nodes_across_half_the_patch[{name}]", hertz.a / spacings[-1], "1")

# %%
theory = {"Cattaneo-Mindlin, (14)": mindlin.traction, "full sliding": mindlin.sliding_traction}
sticks = zone.centre - zone.interpolated, zone.centre + zone.interpolated
picture = stick_slip_figure(
    x, abs(patch.tau), mu * patch.p, theory, sticks, hertz.a, title=f"Uncoupled, {name}"
)
scene.figure(picture, "uncoupled")
lines = {key: np.array(values) for key, values in errors.items()}
picture = convergence_figure(np.array(spacings), lines, "node spacing (mm)", "error (relative)", order=1)
scene.figure(picture, "refinement")
scene.finish(last)
