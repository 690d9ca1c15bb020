# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Section 3.1.2: pressed, and pulled along
#
# The cylinder of section 3.1.1 is pulled along the road with Q = 0.75 mu P, mu = 0.5. Where pressure and
# shear do not influence each other, Cattaneo and Mindlin find slip at both edges and a stick zone of half
# width c in the middle,
#
# $$ |\tau| = \mu p_0 \left( \sqrt{1 - x^2/a^2} - \tfrac{c}{a} \sqrt{1 - x^2/c^2} \right) \ (|x| \le c), \qquad
#    |\tau| = \mu p \ (c \le |x| \le a) \tag{14} $$
#
# $$ c = a \sqrt{1 - \tfrac{Q}{\mu P}} = \tfrac{a}{2} \tag{15} $$
#
# and Carter, for steady rolling, the same two ellipses with the stick zone at the leading edge, here on the
# right. The paper loads in two ways:
#
# 1. *subsequent*: P in ten steps, then Q in ten steps;
# 2. *initial*: both together in ten steps.
#
# **How the body is held.** Q pulls at the height R above the road, so something must balance the moment Q R.
# If nothing held the flat face, the pressure would have to, by moving Q R / P = 3.75 mm ahead, five half
# widths of the patch: the cylinder would roll away. Here P and Q act on a rigid platen, glued to the flat
# face, that moves in x and y but does not tilt. What is left of rolling is that the elastic body between platen
# and road is sheared, which turns the material above the patch.

# %%
from dataclasses import replace
from time import perf_counter

import numpy as np
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder, half_cylinder_nested
from model import BodyOnRoad, ContactSolver, follow, solve
from model.closed_forms.carter import Carter
from model.closed_forms.hertz import HertzCylinder
from model.closed_forms.mindlin import MindlinCylinder
from model.figures.figures import stick_slip_figure
from model.results.pressure import contact_half_width, line_error

scene = Scene("section_3_1_2_tangential_loading", "A half cylinder pressed and pulled along (section 3.1.2).")
scene.built("K")
scene.left_out("M", "C", "gmsh", "pyvista")
R, E, P, mu, steps = 10.0, 210e3, 1e4, 0.5, 10  # mm, MPa, N/mm
Q = 0.75 * mu * P
part = np.arange(1, steps + 1) / steps
assembly_seconds = 0.0


def under_platen(body, nu, friction, held=False):
    """Half cylinder under its platen, with the loads P and Q on it; `held` in x for a frictionless road."""
    global assembly_seconds
    began = perf_counter()
    elasticity = Elasticity(body, Isotropic(E, nu), mean_dilatation=nu > 0.4)  # else the cells would lock
    support = Support(body).platen("top")
    if held:
        support.fix("top", x=0.0)
    system = support.apply(elasticity.stiffness(), elasticity.total_force("top", (0.0, -P)))
    pull = system.reduce(elasticity.total_force("top", (Q, 0.0)))
    pressed = BodyOnRoad(elasticity, system, Plane(), "arc", friction, reach=0.3 * R)
    assembly_seconds += perf_counter() - began
    return pressed, system.load, pull


# %% [markdown]
# ## The two scenarios: figures 6 and 7
#
# An elastic body on a rigid road has Dundurs' beta = 0.29: normal loading alone drags the surface outwards.
# At the trailing edge (left) this adds to the shear due to Q and makes it slip; at the leading edge the two
# have opposite signs. So in both scenarios the stick zone moves to the leading edge, and where P and Q grow
# together, so that what has been laid down at the leading edge is never asked for more, it reaches it.

# %%
pressed, push, pull = under_platen(Body.from_grid(half_cylinder(R)), nu=0.3, friction=mu)
hertz = HertzCylinder(P, R, E, nu=0.3)
mindlin, carter = MindlinCylinder(hertz, Q, mu), Carter(hertz, Q, mu)
scenarios = {
    "subsequent": [push * k for k in part] + [push + pull * k for k in part],
    "initial": [(push + pull) * k for k in part],
}
theories = {
    "subsequent": {"full sliding": mindlin.sliding_traction, "Cattaneo-Mindlin, (14)": mindlin.traction},
    "initial": {"rolling (Carter)": carter.traction, "Cattaneo-Mindlin, (14)": mindlin.traction},
}
x, nodes = pressed.points[:, 0], pressed.problem.contact_nodes
for figure, (name, loads) in enumerate(scenarios.items(), start=6):
    path = list(follow(ContactSolver(pressed.problem), loads, tolerance=1e-11))
    last, stuck_at = path[-1], path[-2].displacement[nodes]
    p, tau = pressed.pressure(last), pressed.traction(last)[:, 0]
    slips = last.status == 1
    slip = np.where(slips, (last.displacement[nodes] - stuck_at)[:, 0], 0.0)
    sticks = x[last.status == 2].min(), x[last.status == 2].max()
    touches = x[last.status > 0].min(), x[last.status > 0].max()
    excess = max(np.max((abs(s.contact_force[:, 0]) - mu * s.pressure_force) / pressed.area) for s in path)
    scene.result(f"p0[{name}]", p.max(), "MPa", hertz.p0, "Hertz, frictionless")
    scene.result(f"stick_from[{name}]", sticks[0], "mm")
    scene.result(f"stick_to[{name}]", sticks[1], "mm")
    scene.result(f"contact_from[{name}]", touches[0], "mm", -hertz.a, "Hertz, frictionless")
    scene.result(f"contact_to[{name}]", touches[1], "mm", hertz.a, "Hertz, frictionless")
    scene.result(f"tangential_force_error[{name}]", abs(last.contact_force[:, 0].sum() / Q + 1), "1", 0.0)
    scene.result(f"max_coulomb_violation[{name}]", max(excess, 0.0) / p.max(), "1", 0.0, "eq. (7), of p0")
    scene.result(
        f"max_slip_power[{name}]", np.max((tau * slip)[slips]), "MPa mm", 0.0, "at most: tau opposes it"
    )
    title = f"Figure {figure}: {name} loading, the leading edge on the right"
    picture = stick_slip_figure(x, abs(tau), mu * p, theories[name], sticks, hertz.a, slip, title)
    scene.figure(picture, f"figure_{figure}")
    pressed.write(scene.out / f"{name}.xdmf", last)
solved = replace(pressed.problem, b=loads[-1], tangential_reference=stuck_at)
solved.save(scene.out / "problem.npz", last)

# %% [markdown]
# ## The coupling taken out: Cattaneo and Mindlin met
#
# Equations (14) and (15) leave out three things, and so do we, as far as we can: the shear from normal
# loading (P is laid on without friction, and friction switched on where the nodes then are), the influence of
# shear on pressure (nu = 0.49 instead of 0.3, beta = 0.02 instead of 0.29), and the roundness of the body,
# which stays: its turning moves the patch by 0.01 mm, so we count x from the middle of the patch. As
# mu p - |tau| is an ellipse over the stick zone, its zeros locate c between the nodes.

# %%
hertz = HertzCylinder(P, R, E, nu=0.49)
mindlin = MindlinCylinder(hertz, Q, mu)
bodies = {"760 quads": Body.from_grid(half_cylinder(R))}
for k in (3,) if scene.quick else (3, 4, 5):
    bodies[f"{56 * 4**k} quads"] = Body.from_grid(half_cylinder_nested(R), refinements=k)
for name, body in scene.progress(bodies.items(), "uncoupled"):
    smooth, _, _ = under_platen(body, nu=0.49, friction=None, held=True)
    laid_on = solve(smooth.problem, "direct")
    rough, push, pull = under_platen(body, nu=0.49, friction=mu)
    rough.problem.tangential_reference = laid_on.displacement[rough.problem.contact_nodes]
    *_, last = follow(ContactSolver(rough.problem, "direct"), [push + pull * k for k in part])
    x, p, tau = rough.points[:, 0], rough.pressure(last), rough.traction(last)[:, 0]
    patch = contact_half_width(x, p, last.status > 0)
    x = x - patch.centre
    zone = contact_half_width(x, mu * p - abs(tau), last.status == 2)
    spacing = np.diff(np.sort(x))[x.size // 2]
    error = line_error(x, abs(tau), mindlin.traction)
    for key in (f"uncoupled, {name}", "uncoupled"):  # the last, finest mesh is the one that counts
        scene.result(f"c_over_a[{key}]", zone.interpolated / hertz.a, "1", 0.5, "eq. (15)")
        scene.result(f"tau_L2_error[{key}]", error, "1", 0.0, "eq. (14)")
    scene.result(f"nodes_across_half_the_patch[{name}]", hertz.a / spacing, "1")
scene.result("patch_centre[uncoupled]", patch.centre, "mm", 0.0, "eq. (14)")
scene.result("stick_centre[uncoupled]", zone.centre, "mm", 0.0, "eq. (14), from the middle of the patch")
theory = {"Cattaneo-Mindlin, (14)": mindlin.traction, "full sliding": mindlin.sliding_traction}
sticks = zone.centre - zone.interpolated, zone.centre + zone.interpolated
picture = stick_slip_figure(x, abs(tau), mu * p, theory, sticks, hertz.a, title=f"Uncoupled, {name}")
scene.figure(picture, "uncoupled")

# %%
scene.cost(**last.cost(), assembly_seconds=assembly_seconds)
scene.finish()
