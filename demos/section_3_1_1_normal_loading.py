# %% [markdown]
# # Section 3.1.1: a cylinder pressed on a road
#
# **You will learn** how a body above a road becomes a contact problem, how well Hertz's theory describes it, and what
# friction changes. **You need** plane strain, and the contact conditions of a single node. A cylinder of radius $R$ is pressed with the force $P$ per length on a rigid plane. Hertz takes the body for a half space:
#
# $$ p(x) = p_0 \sqrt{1 - x^2/a^2}, \qquad p_0 = \sqrt{\frac{P E^*}{\pi R}}, \tag{12} $$
# $$ a = \sqrt{\frac{4 P R}{\pi E^*}}, \qquad E^* = \frac{E}{1 - \nu^2}. \tag{13} $$
#
# The discrete problem: find $u$ and forces of the road, $p_i$ along its normal $n_i$ and $\tau_i$ across it, with
# $K u = b + f$ (equation (3) at rest) and at each node that may touch
#
# $$ g_i = g_i^0 + n_i \cdot u_i \ge 0, \qquad p_i \ge 0, \qquad p_i g_i = 0, \qquad |\tau_i| \le \mu p_i. \tag{5, 6, 7} $$
#
# **Without friction: figures 3b and 4.** UFL forms make $K$ and $b$, the node loop does the rest, on 760 quadrilaterals as in
# the paper. $P$ comes as a uniform traction on the flat face, or through a rigid platen.

# %%
from harness.pictures import contact_zone, patch_figure
from harness.readings import note_laws, read_patch, save_last_step
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder
from model import BodyOnRoad, HertzCylinder, Spence, Status, follow, line_error, mesh_figure, solve

scene = Scene("section_3_1_1_normal_loading", "An elastic half cylinder pressed on a rigid road.")
scene.built("K").left_out("M", "C", "gmsh")
R, E, nu, P, mu = 10.0, 210e3, 0.3, 1e4, 0.5  # mm, MPa, 1, N/mm, 1
hertz = HertzCylinder(P, R, E, nu)
spence = Spence(hertz, mu)


@scene.assembly
def cylinder(platen=False, friction=None, force=P):
    body = Body.from_grid(half_cylinder(R))
    elasticity, middle = Elasticity(body, Isotropic(E, nu)), body.nearest_node((0.0, R))
    free = Support(body)
    support = free.platen("top").fix("top", x=0.0) if platen else free.fix_node(middle, x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -force)), support)
    return BodyOnRoad(system, "arc", Plane(), friction=friction, reach=0.3 * R)


pressed = cylinder()
solution = solve(pressed.problem, "direct", tolerance=1e-12)
patch, theory = read_patch(pressed, solution), {"Hertz, eq. (12)": hertz.pressure}
scene.result("p0[mu=0]", patch.p.max(), "MPa", hertz.p0, "Hertz, eq. (12); the paper: 8555")
scene.result("a[mu=0]", patch.width.interpolated, "mm", hertz.a, "Hertz, eq. (13); the paper: 0.75")
scene.result("a_lower[mu=0]", patch.width.lower, "mm", 0.73, "the paper, last node in contact")
scene.result("a_upper[mu=0]", patch.width.upper, "mm", 0.80, "the paper, first node out")
scene.result("pressure_L2_error[mu=0]", line_error(patch.x, patch.p, hertz.pressure), "1", 0.0, "eq. (12)")
note_laws(scene, "mu=0", pressed, [solution], (0.0, P))
scene.figure(mesh_figure(pressed.system.body, title="760 bilinear quadrilaterals (figure 3b)"), "figure_3b")
scene.figure(patch_figure(patch, theory, hertz.a, "mu = 0 (figure 4)"), "figure_4")
scene.figure(contact_zone(pressed, solution, centre=(0.0, 0.8), width=4.0), "deformed")
pressed.write(scene.out / "frictionless.xdmf", solution)

# %% [markdown]
# **With friction, in ten steps: figure 5.** An elastic body on a rigid road spreads as it is pressed, so normal loading alone
# causes shear: the peak grows, the patch shrinks a little, its edge slips. Spence (1975) solved the half-plane problem.

# %%
rubbing = cylinder(platen=True, friction=mu)
loads = [rubbing.problem.b * (k / 10) for k in range(1, 11)]
path = list(follow(rubbing.problem, loads, "direct", tolerance=1e-12))
patch = read_patch(rubbing, path[-1], degree=2)
scene.result("p0[mu=0.5]", patch.p.max(), "MPa", spence.p0, "Spence, half plane")
scene.result("a[mu=0.5]", patch.width.interpolated, "mm", spence.a, "Spence, half plane")
scene.result("stick_half_width[mu=0.5]", patch.zone(Status.STICK)[1], "mm", spence.c, "Spence, half plane")
note_laws(scene, "mu=0.5", rubbing, path, (0.0, P), mu)
theory = {"Hertz, mu = 0": hertz.pressure, "Spence, p": spence.pressure, "Spence, tau": spence.traction}
scene.figure(patch_figure(patch, theory, hertz.a, "mu = 0.5, ten steps (figure 5)"), "figure_5")
rubbing.write(scene.out / "friction.xdmf", path[-1])
save_last_step(scene.out / "problem.npz", rubbing, path)
scene.finish(solution)

# %% [markdown]
# **In ParaView**, open `friction.xdmf` and `friction_road.xdmf` (*XDMF Reader*), *Warp By Vector* on `displacement`, colour by the
# X component of `contact_traction`: it changes its sign in the middle of the patch.
#
# ## Exercises
#
# 1. Press with a quarter of P. How should a and p0 change by (12) and (13), and how do they?
# 2. A platen keeps the flat face straight. Is the peak pressure without friction higher under it, and why?
# 3. Take mu = 0.1 in place of 0.5. Where does it stick, and what becomes of the peak?
#
# **Further reading.** K. L. Johnson, *Contact Mechanics*, Cambridge, 1985, chapters 4 and 5. D. A. Spence, *The Hertz
# contact problem with finite friction*, Journal of Elasticity 5 (1975) 297-319.

# %% tags=["hide-cell"]
light, straight, slippery = cylinder(force=P / 4), cylinder(platen=True), cylinder(platen=True, friction=0.1)
# 1. Both fall by one half, up to the mesh, which is coarse for the smaller patch.
halved = read_patch(light, solve(light))
assert abs(halved.width.interpolated / hertz.a - 0.5) < 0.01 and abs(halved.p.max() / hertz.p0 - 0.5) < 0.01
# 2. Yes, by 0.3 %: under a uniform traction the flat face bends down in the middle, which spreads the pressure.
assert 0 < read_patch(straight, solve(straight)).p.max() / scene.value("p0[mu=0]") - 1 < 0.005
# 3. Only near the middle (Spence: c = 0.05 a), and the peak lies between Hertz's and that of mu = 0.5.
patch = read_patch(slippery, list(follow(slippery.problem, loads))[-1])
assert patch.zone(Status.STICK)[1] < 0.2 * hertz.a and hertz.p0 < patch.p.max() < scene.value("p0[mu=0.5]")
