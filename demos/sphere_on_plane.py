# %% [markdown]
# # A sphere on a plane: Hertz and Mindlin in space
#
# **You will learn** that the loop in space is the loop in the plane with blocks of three instead of two, and how a
# contact map is read. **You need** sections 3.1.1 and 3.1.2.
#
# A steel sphere of radius $R$ is pressed by $F$ on a rigid plane,
#
# $$ a^3 = \frac{3 F R}{4 E^*}, \qquad p_0 = \frac{3 F}{2 \pi a^2}, \qquad
#    p(r) = p_0 \sqrt{1 - r^2/a^2} \qquad \text{(Hertz)}, \tag{a} $$
#
# and then pushed sideways by Q below the limit of friction: an annulus slips, a disc of radius c sticks,
#
# $$ c = a \left(1 - \frac{Q}{\mu F}\right)^{1/3} \qquad \text{(Mindlin)}. \tag{b} $$
#
# The lower half of the ball is meshed with nested hexahedra: a block at the contact within growing shells. By symmetry
# a quarter of it will do for F, and a half for Q along x. Its flat face is a rigid platen. (a) puts the squares of the
# pressures on a parabola over r; where it ends is a.

# %%
from dataclasses import replace

import numpy as np
from harness.pictures import pushed_sphere
from harness.readings import coulomb_violation, radius_in_space, sticking_share
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_ball
from model import BodyOnRoad, ContactSolver, HertzSphere, MindlinSphere, follow, solve

scene = Scene("sphere_on_plane", "A steel sphere pressed on a plane and pushed: Hertz and Mindlin in space.")
scene.built("K").left_out("M", "C", "gmsh")
R, E, nu, F, mu = 10.0, 210e3, 0.3, 15e3, 0.5  # mm, MPa, 1, N, 1
hertz, SHARE = HertzSphere(F, R, E, nu), {"quarter": 1 / 4, "half": 1 / 2}


@scene.assembly
def ball(part, refinements, friction=None):
    elasticity = Elasticity(Body.from_grid(half_ball(R, part), refinements), Isotropic(E, nu))
    support = Support(elasticity.body).platen("top").fix("y0", y=0.0)
    if friction is None:  # no push
        support.fix("x0" if part == "quarter" else "top", x=0.0)
    force = elasticity.total_force("top", (0.0, 0.0, -SHARE[part] * F))
    system = elasticity.system(force, support)
    return BodyOnRoad(system, "sphere", Plane(normal=(0.0, 0.0, 1.0)), friction=friction, reach=0.15 * R)


for refinements in (1, 2):
    pressed = ball("quarter", refinements)
    solution = solve(pressed.problem, "multigrid", tolerance=1e-8)
    p, dofs = pressed.pressure(solution), pressed.problem.b.size
    scene.result(f"p0[dofs={dofs}]", p.max(), "MPa", hertz.p0, "Hertz, eq. (a)")
    scene.result(f"a[dofs={dofs}]", radius_in_space(pressed, solution), "mm", hertz.a, "Hertz, eq. (a)")
    scene.result(f"cycles[dofs={dofs}]", solution.cycles, "V(1,1)", 20, "wanted", "at most")
scene.result("min_gap", solution.gap.min(), "mm", 0.0, "eq. (5)")
scene.result("min_pressure", p.min(), "MPa", 0.0, "eq. (6)")
scene.result("force_balance_error", abs(4 * solution.pressure_force.sum() / F - 1), "1", 0.0, "equilibrium")
pressed.problem.save(scene.out / "problem.npz", solution)

# %% [markdown]
# **Pushed: partial slip.** F first, without friction, so that the shear that it would cause (an elastic body on a rigid
# road spreads) is left out, as in (b); then Q in steps with friction. Nodes stick where F has left them.

# %%
smooth, rubbing, parts = ball("half", 2), ball("half", 2, friction=mu), (0.25, 0.5, 0.75)
laid_on = solve(smooth.problem, "multigrid").displacement[rubbing.problem.contact_nodes]
problem = replace(rubbing.problem, tangential_reference=laid_on)
push = rubbing.system.reduce(rubbing.elasticity.total_force("top", (mu * F / 2, 0.0, 0.0)))
path = list(follow(ContactSolver(problem, "multigrid"), [problem.b + part * push for part in parts], 1e-8))
for part, slipped in zip(parts, path):
    mindlin, name = MindlinSphere(hertz, part * mu * F, mu), f"Q={part} mu F"
    c_over_a = np.sqrt(sticking_share(rubbing, slipped))
    scene.result(f"c_over_a[{name}]", c_over_a, "1", mindlin.c / hertz.a, "Mindlin, eq. (b)")
    scene.result(f"cycles[{name}]", slipped.cycles, "V(1,1)")
pushed = -2 * slipped.contact_force[:, 0].sum() / (part * mu * F)
scene.result("max_coulomb_violation", coulomb_violation(rubbing, path, mu), "p0", 0.0, "Coulomb's law")
scene.result("tangential_balance_error", abs(pushed - 1), "1", 0.0, "equilibrium")
for name, figure in pushed_sphere(rubbing, slipped, hertz, mindlin, f"Q = {part} mu F").items():
    scene.figure(figure, name)
rubbing.write(scene.out / "sphere.xdmf", slipped)
scene.finish(solution)

# %% [markdown]
# **In ParaView**, look at `sphere.xdmf` from below, colour by `status` (2 sticks, 1 slips), then by `contact_traction`.
#
# ## Exercises
#
# 1. Press with an eighth of the force. How should a and p0 change, and how well does this mesh still see it?
# 2. At which Q is half of the patch's area in slip? Check it.
# 3. The patch of the picture is not symmetric: pressure is higher ahead of the push. Which assumption of (b) fails?

# %% tags=["hide-cell"]
# 1. Both are halved; of the patch of three nodes across a radius p0 is still right to a few per cent.
eighth = solve(replace(pressed.problem, b=pressed.problem.b / 8), "multigrid")
assert abs(pressed.pressure(eighth).max() / (hertz.p0 / 2) - 1) < 0.05
# 2. (c/a)^2 = 1/2, so Q = (1 - 0.5^1.5) mu F = 0.65 mu F.
*_, half = follow(ContactSolver(problem, "multigrid"), [problem.b + (1 - 0.5**1.5) * push], 1e-8)
assert abs(sticking_share(rubbing, half) - 0.5) < 0.05
# 3. That shear does not change the pressure: for nu = 0.3 it does, by up to mu times Dundurs' 0.29.
assert rubbing.pressure(slipped) * rubbing.area @ rubbing.points[:, 0] > 0

# %% [markdown]
# **Further reading.** K. L. Johnson, *Contact Mechanics*, Cambridge, 1985, chapters 4 and 7. The meshes up to a million
# unknowns, and what other solvers need for them: `reports/sphere_refinement.py`.
