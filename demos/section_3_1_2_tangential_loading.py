# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Section 3.1.2: pressed, and pulled along
#
# The cylinder of section 3.1.1 is pulled along the road with Q = 0.75 mu P, mu = 0.5. Where nothing couples pressure and shear,
# Cattaneo and Mindlin find slip at both edges and a stick zone of half width c in the middle,
#
# $$ |\tau| = \mu p_0 \left( \sqrt{1 - x^2/a^2} - \tfrac{c}{a} \sqrt{1 - x^2/c^2} \right) \ (|x| \le c), \qquad
#    |\tau| = \mu p \ (c \le |x| \le a), \qquad c = a \sqrt{1 - \tfrac{Q}{\mu P}} = \tfrac{a}{2} \tag{14, 15} $$
#
# and Carter, for steady rolling, the same two ellipses with the stick zone at the leading edge. The paper loads in two ways:
#
# 1. *subsequent*: P in ten steps, then Q in ten steps;
# 2. *initial*: both together in ten steps.
#
# **How the body is held** decides how much it rolls. Here P and Q act on a rigid platen on the flat face that translates but does not tilt: the
# moment Q R is the platen's, and what is left of rolling is the elastic turning of the material above the patch. That alone moves the stick
# zone to the leading edge (right), as the paper finds; in scenario 2 it reaches it.

# %%
from dataclasses import replace
from time import perf_counter

import matplotlib.pyplot as plt
import numpy as np

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder, half_cylinder_nested
from model import BodyOnRoad, ContactSolver, follow, solve
from model.carter import Carter
from model.hertz import HertzCylinder
from model.mindlin import MindlinCylinder
from model.pressure import line_error
from model.scene import Scene

scene = Scene(
    "section_3_1_2_tangential_loading",
    "The half cylinder pressed and pulled along the road (paper, section 3.1.2).",
)
scene.built("K")
scene.left_out("M", "C", "gmsh", "pyvista")
R, E, nu, P, mu, steps = 10.0, 210e3, 0.3, 1e4, 0.5, 10  # mm, MPa, 1, N/mm, 1, 1
Q = 0.75 * mu * P
hertz = HertzCylinder(P, R, E, nu)
assembly_seconds = 0.0
mindlin, carter = MindlinCylinder(hertz, Q, mu), Carter(hertz, Q, mu)


def under_platen(grid, refinements=0, friction=mu, held=False):
    """Half cylinder under a platen, and the loads P and Q on it."""
    global assembly_seconds
    began = perf_counter()
    body = Body.from_grid(grid, refinements)
    elasticity = Elasticity(body, Isotropic(E, nu))
    support = Support(body).platen("top")
    if held:
        support.fix("top", x=0.0)
    system = support.apply(elasticity.stiffness(), elasticity.total_force("top", (0.0, -P)))
    pull = system.reduce(elasticity.total_force("top", (Q, 0.0)))
    pressed = BodyOnRoad(elasticity, system, Plane(), "arc", friction, reach=0.3 * R)
    assembly_seconds += perf_counter() - began
    return pressed, system.load, pull


def stick_zone(x, solution):
    """First and last sticking node, mm."""
    stuck = x[solution.status == 2]
    return stuck.min(), stuck.max()


# %% [markdown]
# ## The two scenarios: figures 6 and 7

# %%
pressed, push, pull = under_platen(half_cylinder(R))
x = pressed.points[:, 0]
order = np.argsort(x)
part = np.arange(1, steps + 1) / steps
scenarios = {
    "subsequent": [push * k for k in part] + [push + pull * k for k in part],
    "initial": [(push + pull) * k for k in part],
}
lines = {
    "subsequent": {"full sliding": mindlin.sliding_traction, "Cattaneo-Mindlin, eq. (14)": mindlin.traction},
    "initial": {"rolling, Carter": carter.traction, "Cattaneo-Mindlin, eq. (14)": mindlin.traction},
}
fine = hertz.a * np.sin(np.linspace(-np.pi / 2, np.pi / 2, 801))
for number, (name, loads) in enumerate(scenarios.items()):
    path = list(follow(ContactSolver(pressed.problem, "direct"), loads, tolerance=1e-11))
    last, stuck_at = path[-1], path[-2].displacement[pressed.problem.contact_nodes]
    p, tau = pressed.pressure(last), pressed.traction(last)[:, 0]
    excess = max(np.max(np.abs(s.contact_force[:, 0]) - mu * s.pressure_force) for s in path)
    slip = (last.displacement[pressed.problem.contact_nodes] - stuck_at)[:, 0]
    first, final = stick_zone(x, last)
    scene.result(f"p0[{name}]", p.max(), "MPa", hertz.p0, "Hertz")
    scene.result(f"stick_from[{name}]", first, "mm")
    scene.result(f"stick_to[{name}]", final, "mm", hertz.a, "the leading edge")
    scene.result(f"contact_to[{name}]", x[last.status > 0].max(), "mm")
    error = abs(last.contact_force[:, 0].sum() / Q + 1)
    scene.result(f"tangential_force_error[{name}]", error, "1", 0.0, "equilibrium")
    scene.result(
        f"max_coulomb_violation[{name}]",
        max(excess, 0.0) / pressed.area.min() / hertz.p0,
        "p0",
        0.0,
        "eq. (7)",
    )
    power = np.max((last.contact_force[:, 0] * slip)[last.status == 1])
    scene.result(f"max_slip_power[{name}]", power, "N/mm mm", 0.0, "friction never helps, at most 0")
    figure, axes = plt.subplots(figsize=(6.4, 4.4), layout="constrained")
    for dash, (label, function) in zip(("-", "--"), lines[name].items(), strict=True):
        axes.plot(fine, function(fine), "k", linestyle=dash, linewidth=1, label=label)
    axes.plot(x[order], mu * p[order], color="0.6", linestyle=":", label="mu p, computed")
    axes.plot(
        x[order], -tau[order], "D", color="black", markerfacecolor="none", markersize=5, label="tau, computed"
    )
    axes.axvspan(first, final, color="0.9", label="sticks")
    moving = (last.status == 1) & (p > 0)
    scale = 0.08 * hertz.a / max(np.abs(slip[moving]).max(initial=0.0), 1e-300)
    axes.quiver(x[moving], np.full(moving.sum(), -250.0), scale * slip[moving], 0 * slip[moving], angles="xy",
                scale_units="xy", scale=1, width=0.004)  # fmt: skip
    axes.set(xlim=(-1.4 * hertz.a, 1.4 * hertz.a), xlabel="x (mm); the leading edge is on the right",
             ylabel="shear stress (MPa)", title=f"Scenario {number + 1}, {name} loading (figure {number + 6})")  # fmt: skip
    axes.legend(frameon=False, fontsize="small", loc="upper left")
    scene.figure(figure, f"figure_{number + 6}")
    pressed.write(scene.out / f"{name}.xdmf", last)
replace(pressed.problem, b=loads[-1], tangential_reference=stuck_at).save(scene.out / "problem.npz", last)

# %% [markdown]
# ## The coupling taken out: Cattaneo and Mindlin met
#
# P is laid on without friction, so that no shear is left from it; then friction is switched on where the nodes are, and Q rises in ten steps. The
# stick zone is taken to end half-way between the last sticking and the first slipping node.

# %%
refinements = (3,) if scene.quick else (3, 4, 5)
for k in scene.progress(refinements, "uncoupled"):
    smooth, _, _ = under_platen(half_cylinder_nested(R), k, friction=None, held=True)
    laid_on = solve(smooth.problem, tolerance=1e-10)
    rough, push, pull = under_platen(half_cylinder_nested(R), k)
    problem = replace(rough.problem, tangential_reference=laid_on.displacement[rough.problem.contact_nodes])
    loads = [push + pull * (n / steps) for n in range(steps + 1)]
    last = list(follow(ContactSolver(problem), loads, tolerance=1e-9))[-1]
    xs = np.sort(rough.points[:, 0])
    first, final = stick_zone(rough.points[:, 0], last)
    spacing = xs[np.searchsorted(xs, final) + 1] - final
    c = 0.5 * (final - first + spacing)
    tau = -rough.traction(last)[:, 0]
    middle = 0.5 * (first + final)
    error = line_error(rough.points[:, 0], tau, mindlin.traction)
    scene.result(f"c_over_a[uncoupled, spacing={spacing / hertz.a:.3f} a]", c / hertz.a, "1", 0.5, "eq. (15)")
scene.result("c_over_a[uncoupled]", c / hertz.a, "1", 0.5, "eq. (15)")
scene.result("tau_L2_error[uncoupled]", error, "1", 0.0, "eq. (14)")
scene.result(
    "stick_centre[uncoupled]", middle / hertz.a, "a", 0.0, "eq. (14); the body's own turning moves it"
)
figure, axes = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
axes.plot(fine, mindlin.traction(fine), "k-", linewidth=1, label="Cattaneo-Mindlin, eq. (14)")
axes.plot(fine, mindlin.sliding_traction(fine), "k--", linewidth=1, label="full sliding")
axes.plot(
    rough.points[:, 0], tau, "D", color="black", markerfacecolor="none", markersize=4, label="tau, computed"
)
axes.axvspan(first, final, color="0.9", label="sticks")
axes.set(
    xlim=(-1.4 * hertz.a, 1.4 * hertz.a),
    xlabel="x (mm)",
    ylabel="shear stress (MPa)",
    title="Coupling taken out",
)
axes.legend(frameon=False, fontsize="small")
scene.figure(figure, "uncoupled")

# %%
scene.cost(
    dofs=rough.problem.b.size,
    contact_candidates=rough.problem.contact_nodes.size,
    sweeps=last.sweeps,
    cycles=last.cycles,
    work_units=last.work_units,
    assembly_seconds=assembly_seconds,
    solve_seconds=last.seconds,
    residual=last.residual,
)
scene.finish()
