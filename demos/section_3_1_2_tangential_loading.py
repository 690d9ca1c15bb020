# %% [markdown]
# # Section 3.1.2: pressed, and pulled along
#
# **You will learn** that friction remembers in the plane too: the same two forces, laid on in another order, stick elsewhere.
# **You need** section 3.1.1, and {doc}`load_paths`.
#
# The cylinder is pressed with $P$ and pulled along the road with $Q = \tfrac34 \mu P$. Where pressure and shear do not
# influence each other, Cattaneo and Mindlin find slip at both edges and a stick zone of half width $c$ in the middle,
#
# $$ |\tau| = \mu p_0 \left( \sqrt{1 - x^2/a^2} - \tfrac{c}{a} \sqrt{1 - x^2/c^2} \right) \ (|x| \le c), \qquad
#    |\tau| = \mu p \ (c \le |x| \le a), \tag{14} $$
# $$ c = a \sqrt{1 - Q / (\mu P)} = \tfrac{a}{2}, \tag{15} $$
#
# and Carter, for steady rolling, the same two ellipses with the stick zone at the leading edge, here on the right. The
# paper loads in two ways (figures 6 and 7): *subsequent*, $P$ in ten steps, then $Q$ in ten; *initial*, both together in ten. Both
# act on a rigid platen that does not tilt. An elastic body on a rigid road has Dundurs' $\beta = \frac{1 - 2 \nu}{2 (1 - \nu)} = 0.29$:
# pressing alone drags its surface outwards. At the trailing edge (left) that adds to the shear due to $Q$, at the leading edge it
# has the other sign. So the stick zone moves to the leading edge, and reaches it where $P$ and $Q$ grow together.

# %%
from dataclasses import replace

import numpy as np
from harness.pictures import traction_figure
from harness.readings import last_slip, note_laws, note_pulled, note_uncoupled, read_patch, save_last_step
from harness.refusals import refusal
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder
from model import BodyOnRoad, Carter, HertzCylinder, MindlinCylinder, Status, follow, solve

scene = Scene("section_3_1_2_tangential_loading", "A half cylinder pressed and pulled along (section 3.1.2).")
scene.built("K").left_out("M", "C", "gmsh", "pyvista")
R, E, P, mu = 10.0, 210e3, 1e4, 0.5  # mm, MPa, N/mm, 1
Q, part = 0.75 * mu * P, np.arange(1, 11) / 10


@scene.assembly
def under_platen(nu, friction):
    elasticity = Elasticity(Body.from_grid(half_cylinder(R)), Isotropic(E, nu), mean_dilatation=nu > 0.4)
    push, pull = (elasticity.total_force("top", force) for force in ((0.0, -P), (Q, 0.0)))
    support = Support(elasticity.body).platen("top")
    system = elasticity.system(push, support if friction else support.fix("top", x=0.0))
    contact = BodyOnRoad(system, "arc", Plane(), friction=friction, reach=0.3 * R)
    return contact, system.load, system.reduce(pull)


pressed, push, pull = under_platen(nu=0.3, friction=mu)
hertz = HertzCylinder(P, R, E, nu=0.3)
mindlin, carter = MindlinCylinder(hertz, Q, mu), Carter(hertz, Q, mu)
slides, rolls = {"full sliding": mindlin.sliding_traction}, {"rolling (Carter)": carter.traction}
scenarios = {
    "subsequent": ([push * k for k in part] + [push + pull * k for k in part], slides),
    "initial": ([(push + pull) * k for k in part], rolls),
}
for number, (name, (loads, theory)) in enumerate(scenarios.items(), start=6):
    path = list(follow(pressed.problem, loads, tolerance=1e-11))
    patch, slip = read_patch(pressed, path[-1]), last_slip(pressed, path)
    note_pulled(scene, name, patch, slip, hertz, path[-1], Q)
    note_laws(scene, name, pressed, path, (-Q, P), mu)
    exact, title = theory | {"Cattaneo-Mindlin, (14)": mindlin.traction}, f"{name} loading, towards the right"
    scene.figure(traction_figure(patch, mu, exact, hertz.a, title, slip=slip), f"figure_{number}")
    pressed.write(scene.out / f"{name}.xdmf", path[-1])
save_last_step(scene.out / "problem.npz", pressed, path, loads[-1])

# %% [markdown]
# **The coupling taken out: Cattaneo and Mindlin met.** Equations (14) and (15) leave out the shear from pressing (so P is laid on without friction, and friction switched on
# where the nodes then are) and the influence of shear on pressure (so $\nu = 0.49$, where $\beta = 0.02$). Over the stick
# zone mu p - |tau| is an ellipse, whose zeros locate c between the nodes. `reports/tangential_refinement.py` refines.

# %%
hertz = HertzCylinder(P, R, E, nu=0.49)
mindlin = MindlinCylinder(hertz, Q, mu)
(smooth, *_), (rough, push, pull) = (under_platen(nu=0.49, friction=friction) for friction in (None, mu))
laid_on = solve(smooth.problem, "direct").displacement[rough.problem.contact_nodes]
uncoupled = replace(rough.problem, tangential_reference=laid_on)
*_, last = follow(uncoupled, [push + pull * k for k in part], "direct")
patch, sticks = note_uncoupled(scene, rough, last, mindlin, mu)
theory = {"Cattaneo-Mindlin, (14)": mindlin.traction, "full sliding": mindlin.sliding_traction}
scene.figure(traction_figure(patch, mu, theory, hertz.a, "Uncoupled", sticks), "uncoupled")
scene.finish(last)

# %% [markdown]
# **In ParaView**, open `subsequent.xdmf` and `initial.xdmf` side by side and colour by `status`: 2 sticks, 1 slips.
#
# ## Exercises
#
# 1. Pull with Q = mu P / 4 and Q = 0.95 mu P (uncoupled). What does (15) say, and what do you find?
# 2. Pull back to Q = 0 after scenario 1. Is the shear gone? Where does it slip?
# 3. Pull harder than mu P. What happens, and what does the program say?
#
# **Further reading.** R. D. Mindlin, *Compliance of elastic bodies in contact*, J. Appl. Mech. 16 (1949) 259-268.
# F. W. Carter, *On the action of a locomotive driving wheel*, Proc. R. Soc. A 112 (1926) 151-157.

# %% tags=["hide-cell"]
# 1. c / a = 0.87 and 0.22; the mesh resolves a ninth of a.
for share in (0.25, 0.95):
    *_, last = follow(uncoupled, [push + pull * (k * share / 0.75) for k in part], "direct")
    assert abs(read_patch(rough, last).zone(Status.STICK)[1] / hertz.a - np.sqrt(1 - share)) < 1 / 9
# 2. No: the edges, which slipped forwards, slip backwards, and a locked-in shear of zero sum stays.
*_, last = follow(pressed.problem, scenarios["subsequent"][0] + [push + pull * (1 - k) for k in part])
patch = read_patch(pressed, last)
assert abs(last.contact_force[:, 0].sum()) < 1e-8 * Q and abs(patch.tau).max() > 0.1 * patch.p.max()
# 3. Nothing can balance it: the body would slide away, and one sentence says so.
print(refusal(list, follow(pressed.problem, [push + 2 * pull])))
