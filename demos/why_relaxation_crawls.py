# %% [markdown]
# # Why relaxation crawls
#
# **You will learn** which errors the loop removes at once and which it hardly touches, and what that means for the number of
# sweeps. **You need** {doc}`node_and_spring`; the string on the road from there is the example.
#
# Let $e = \tilde u - u$ be the error of an iterate of the string, without the road. A sweep from left to right makes of a
# wave $e_i = \mathrm{e}^{\mathrm{i} \theta i}$ the wave $G(\theta)\, e_i$, since each node has its left neighbour new, its right one old:
#
# $$ 2 \bar e_i = \bar e_{i-1} + \tilde e_{i+1} \quad\Longrightarrow\quad
#    G(\theta) = \frac{\mathrm{e}^{\mathrm{i} \theta}}{2 - \mathrm{e}^{-\mathrm{i} \theta}}. \tag{a} $$
#
# Waves shorter than four nodes ($\theta > \pi/2$) lose more than half of themselves in a sweep, on every mesh. The longest one
# that fits into $m$ free nodes hardly loses anything:
#
# $$ 1 - |G| \approx \Big( \frac{\pi}{m + 1} \Big)^2. \tag{b} $$
#
# Halve the mesh width, and it takes four times as many sweeps. With the road, the loop first finds out which nodes touch, and then
# has the same waves before it on those that are free. *Coarser meshes* see long waves as short ones: {doc}`multigrid_by_hand`
# makes a method of that, whose cycles are counted here already. Both start from the answer on the next coarser string.

# %%
import numpy as np
from harness.pictures import sweeps_and_cycles
from harness.scene import Scene
from harness.string_multigrid import cycle, from_below, relax, steps

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder_nested
from model import BodyOnRoad, NotConverged, solve

scene = Scene("why_relaxation_crawls", "What the loop does to short and long waves, and what multigrid adds.")
scene.built("K").left_out("M", "C", "friction", "gmsh")
meshes = (31, 63, 127, 255)
sweeps = {n: steps(relax, from_below(n)) for n in meshes}
cycles = {n: steps(cycle, from_below(n)) for n in (*meshes, 511)}
print("sweeps alone:", {n: len(each) for n, each in sweeps.items()})
print("cycles:", {n: len(each) for n, each in cycles.items()})
loss, expected = 1 - sweeps[255][-1] / sweeps[255][-2], (np.pi / 58) ** 2  # 57 nodes are free at each end
scene.result("loss_in_a_sweep[n=255]", loss, "of the error", expected, "eq. (b)")
scene.result("cycles[n=31]", len(cycles[31]), "1")
scene.result("cycles[n=511]", len(cycles[511]), "1", len(cycles[255]), "as many as with half the nodes")
scene.figure(sweeps_and_cycles(sweeps, cycles), "sweeps_and_cycles")

# %% [markdown]
# **A cylinder on the road.** In the plane and in space it is the same. The half cylinder of {doc}`section_3_1_1_normal_loading`, $E = 210$
# GPa, $P = 10$ kN/mm, on finer and finer meshes: four hundred sweeps leave an error of order one, and the package's multigrid (in
# the same manner as that of the string, with conjugate gradients around the cycles) takes as many cycles on each.


# %%
@scene.assembly
def cylinder(refinements):
    """Half cylinder of 56 x 4^k quadrilaterals, pressed on a plane road."""
    body = Body.from_grid(half_cylinder_nested(10.0), refinements)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).fix_node(body.nearest_node((0.0, 10.0)), x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -1e4)), support)
    return BodyOnRoad(system, "arc", Plane(), reach=3.0)


found = []
for k in range(2, 5) if scene.quick else range(2, 7):
    pressed = cylinder(k)
    answer = solve(pressed.problem, "multigrid", tolerance=1e-8)
    try:
        solve(pressed.problem, "none", tolerance=1e-8, limit=10)
    except NotConverged as alone:  # as it must
        found.append((answer.displacement.size, answer.cycles, alone.residual, alone.sweeps))
        print("{} unknowns, {} cycles; the loop alone: {:.0e} after {} sweeps".format(*found[-1]))
scene.result("cycles[coarsest]", found[0][1], "1")
scene.result("cycles[finest]", found[-1][1], "1", found[0][1], "as many as on the coarsest")
scene.result("residual_of_the_loop_alone[finest]", found[-1][2], "1", 0.0, "the loop alone")
pressed.write(scene.out / "pressed.xdmf", answer)
pressed.problem.save(scene.out / "problem.npz", answer)
scene.finish(answer)

# %% [markdown]
# **In ParaView** open `pressed.xdmf`, *Warp By Vector* on `displacement`, and colour by `von_mises`: the answer is smooth away
# from the patch. That is why coarse meshes can deal with most of it.
#
# ## Exercises
#
# 1. From (b): how many sweeps take the longest wave on $m = 57$ free nodes, which the string of 255 has at each end, down by $10^{8}$?
# 2. From $u = 0$, how many sweeps until the loop knows which nodes touch? And how many more until it is done?
# 3. By which power of the number of unknowns do the sweeps grow on a string, in the plane, and in space?
#
# **Further reading.** D. Young, *Iterative Solution of Large Linear Systems*, Academic Press, 1971. W. Briggs, V. Henson, S. McCormick,
# *A Multigrid Tutorial*, 2nd ed., SIAM, 2000, chapter 2.

# %% tags=["hide-cell"]
# 1. |G|^k = 1e-8:
expected = round(8 * np.log(10) / (np.pi / 58) ** 2)
assert 0.5 < len(sweeps[255]) / expected < 2
# 2. A node is let go only once its neighbour is free, which takes a while; the linear problem that is left takes longer.
u, touching = np.zeros(63), []
errors = steps(lambda K, b, lower, u: (relax(K, b, lower, u), touching.append((u == lower).tobytes())), u)
decided = next(k for k in range(len(touching)) if len(set(touching[k:])) == 1)
print(f"{decided} sweeps until it knows what touches, {len(errors) - decided} more")
# 3. m grows as N, N^(1/2) and N^(1/3), and the sweeps as its square: as N^2, N and N^(2/3).
