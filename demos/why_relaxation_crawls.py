# %% [markdown]
# # Why relaxation crawls, and multigrid does not
#
# **You will learn** which errors the loop removes at once and which it hardly touches, how coarser meshes take care of
# those, and what contact changes about that: a truncated multigrid method of thirty lines. **You need**
# {doc}`node_and_spring`; the string on the road from there is the example.
#
# ## Short waves, long waves
#
# Let $e = \tilde u - u$ be the error of an iterate of the string, without the road. A sweep from left to right makes of a
# wave $e_i = \mathrm{e}^{\mathrm{i} \theta i}$ the wave $G(\theta)\, e_i$, since each node has its left neighbour new, its right one old:
#
# $$ 2 \bar e_i = \bar e_{i-1} + \tilde e_{i+1} \quad\Longrightarrow\quad
#    G(\theta) = \frac{\mathrm{e}^{\mathrm{i} \theta}}{2 - \mathrm{e}^{-\mathrm{i} \theta}}. \tag{a} $$
#
# Waves shorter than four nodes ($\theta > \pi/2$) lose more than half of themselves in a sweep, on every mesh. The longest one
# that fits into $m$ free nodes loses $1 - |G| \approx (\pi / (m + 1))^2$: halve the mesh width, and it takes four times as many
# sweeps. With the road, the loop first finds out which nodes touch, and then has the same waves before it on those that are free.

# %%
from functools import partial

import numpy as np
from harness.pictures import sweeps_and_cycles
from harness.scene import Scene
from harness.strings import string
from numba import njit

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder_nested
from model import BodyOnRoad, NotConverged, solve

scene = Scene("why_relaxation_crawls", "What the loop does to short and long waves, and what multigrid adds.")
scene.built("K")
scene.left_out("M", "C", "friction", "gmsh")


@njit
def relax(K, b, lower, u):
    """Sweep once over all nodes, each above its bound (the paper's eq. 9)."""
    for i in range(len(b)):
        u[i] = max(u[i] + (b[i] - K[i] @ u) / K[i, i], lower[i])


def steps(step, u, tolerance=1e-8):
    """Take steps from u, in place, to a small enough force without a road to carry it, of a node's load; return all."""
    (K, b, lower, *_), history = string(len(u)), []
    while not history or history[-1] > tolerance:
        step(K, b, lower, u)
        r = K @ u - b
        history.append(np.abs(np.where(u == lower, np.minimum(r, 0.0), r)).max() / np.abs(b).max())
    return history


# %% [markdown]
# ## The same with coarser strings below
#
# After one sweep the error is *smooth*, so that a string of half as many nodes can represent it: restrict the residual
# to that string, solve for the correction $c$ there (by the same method, until three nodes are left), and interpolate
# it back, $u \leftarrow u + t\, P c$. Only contact needs care, in two places:
#
# - A coarse node reaches over several fine ones. Some of those touch and must not move: their rows of $P$ are set to
#   zero, and the coarse matrix is $P^T K P$ with that *truncated* $P$.
# - The correction may carry other nodes into the road. They are put back on it, and the step $t$ is halved until
#   $J$ has not grown. So $J$ falls in each cycle, which carries the proof of convergence over from the loop alone.
#
# Both start from the answer on the next coarser string (*nested iteration*), which knows about where the contact ends.


# %%
def interpolation(n):
    """From (n - 1)/2 coarse nodes to n fine ones, linear."""
    P = np.zeros((n, n // 2))
    for j in range(n // 2):
        P[2 * j : 2 * j + 3, j] = 0.5, 1.0, 0.5
    return P


def correction(K, r):
    """Approximate the solution of K c = r by a V(1,1) cycle without a road."""
    n, c, free = len(r), np.zeros(len(r)), np.full(len(r), -np.inf)
    if n <= 3:
        return np.linalg.solve(K, r)
    relax(K, r, free, c)
    P = interpolation(n)
    c += P @ correction(coarse(K, P), P.T @ (r - K @ c))
    relax(K, r, free, c)
    return c


def coarse(K, P):
    """Galerkin's product; a coarse node that only reaches nodes which touch gets a lone diagonal entry."""
    product = P.T @ K @ P
    product[np.diag(product) == 0, np.diag(product) == 0] = 1.0
    return product


def cycle(K, b, lower, u, truncate=True):
    """One cycle of truncated multigrid: the loop decides contact, coarser strings take out what is smooth."""
    relax(K, b, lower, u)
    P, r, J = interpolation(len(u)), b - K @ u, lambda v: 0.5 * v @ (K @ v) - b @ v
    r[(u == lower) & (r < 0)] = 0  # what the road carries
    P[(u == lower) & truncate] = 0
    c, t, before = P @ correction(coarse(K, P), P.T @ r), 1.0, J(u)
    while J(np.maximum(u + t * c, lower)) > before + 1e-15 * abs(before):
        t /= 2
    u[:] = np.maximum(u + t * c, lower)
    relax(K, b, lower, u)


def from_below(n):
    """Return a start: what the next coarser string, solved likewise, says on this one (nested iteration)."""
    if n <= 3:
        return np.zeros(n)
    u = from_below(n // 2)
    steps(cycle, u)
    return np.maximum(interpolation(n) @ u, string(n).lower)


meshes = (31, 63, 127, 255)
sweeps = {n: steps(relax, from_below(n)) for n in meshes}
cycles = {n: steps(cycle, from_below(n)) for n in (*meshes, 511)}
print("sweeps alone:", {n: len(each) for n, each in sweeps.items()})
print("cycles:", {n: len(each) for n, each in cycles.items()})
loss, expected = 1 - sweeps[255][-1] / sweeps[255][-2], (np.pi / 58) ** 2  # 57 nodes are free at each end
scene.result("loss_in_a_sweep[n=255]", loss, "of the error", expected, "eq. (a)")
scene.result("cycles[n=31]", len(cycles[31]), "1")
scene.result("cycles[n=511]", len(cycles[511]), "1", len(cycles[255]), "as many as with half the nodes")
scene.figure(sweeps_and_cycles(sweeps, cycles), "sweeps_and_cycles")

# %% [markdown]
# ## A cylinder on the road
#
# The package does the same in the plane and in space, with friction too, with conjugate gradients around the cycles and
# only those coarse rows computed again whose nodes changed. On the half cylinder of
# {doc}`section_3_1_1_normal_loading`, $E = 210$ GPa, $P = 10$ kN/mm:


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
        found.append((answer.displacement.size, answer.cycles, alone.residual))
        print(
            "{} unknowns, {} cycles; the loop alone: {:.0e} after".format(*found[-1]), alone.sweeps, "sweeps"
        )
scene.result("cycles[coarsest]", found[0][1], "1")
scene.result("cycles[finest]", found[-1][1], "1", found[0][1], "as many as on the coarsest")
scene.result("residual_of_the_loop_alone[finest]", found[-1][2], "1", 0.0, "the loop alone")
pressed.write(scene.out / "pressed.xdmf", answer)
pressed.problem.save(scene.out / "problem.npz", answer)

# %% [markdown]
# **In ParaView** open `results/why_relaxation_crawls/pressed.xdmf`, *Warp By Vector* with a scale of 1, and colour by
# `von_mises`: the answer is smooth away from the patch. That is why coarse meshes can deal with most of it.
#
# ## Exercises
#
# 1. From (a): how many sweeps take the longest wave on $m = 57$ free nodes, which the string of 255 has at each end, down by $10^{8}$?
# 2. Leave out the truncation, so that all nodes may be corrected and are then put back on the road. What happens
#    to the number of cycles?
# 3. Start from $u = 0$ instead. How does the number of cycles grow, and what takes them so long?
# 4. With nested iteration, how many cycles a string are enough for the error to be that of its mesh?
# 5. A cycle costs about how many sweeps of the finest string?

# %% tags=["hide-cell"]
# 1. |G|^k = 1e-8 with 1 - |G| ~ (pi / 58)^2:
print("sweeps:", round(8 * np.log(10) / (np.pi / 58) ** 2))

# 2. The cycles still converge, since the sweeps do, but much of each correction is cut off again:
careless = partial(cycle, truncate=False)
print("without truncation:", {n: len(steps(careless, from_below(n))) for n in meshes[:2]}, "cycles")

# 3. The first correction throws nearly the whole string on the road, and a sweep lets go of a node only once its
# neighbour is free: the edge of the contact moves by a node or two a cycle.
print("from u = 0:", {n: len(steps(cycle, np.zeros(n))) for n in meshes}, "cycles")

# 4. One or two: the start is already as good as the next coarser mesh allows.
true = from_below(255)
steps(cycle, true, 1e-11)
of_the_mesh = np.abs(true - string(255).exact).max()
for each in (1, 2, 3):
    u = np.zeros(3)
    for K, b, lower, *_ in map(string, (7, 15, 31, 63, 127, 255)):
        u = np.maximum(interpolation(len(b)) @ u, lower)
        for _ in range(each):
            cycle(K, b, lower, u)
    print(
        f"{each} cycle(s) a string: algebraic error {np.abs(u - true).max():.0e}, of the mesh {of_the_mesh:.0e}"
    )

# 5. Two sweeps on n nodes, and on n/2, n/4, ...: about 4, and as much again for residuals and transfers; in the
# plane 2 (1 + 1/4 + ...) = 8/3, in space 16/7.
print("sweeps of the finest mesh in a V(1,1) cycle:", [round(2 / (1 - 0.5**dim), 2) for dim in (1, 2, 3)])

# %% [markdown]
# **Further reading.** A. Brandt, C. Cryer, *Multigrid algorithms for the solution of linear complementarity problems arising
# from free boundary problems*, SIAM J. Sci. Stat. Comput. 4 (1983) 655-684. R. Kornhuber, *Monotone multigrid methods for
# elliptic variational inequalities I*, Numer. Math. 69 (1994) 167-184. C. Gräser, R. Kornhuber, *Multigrid methods for
# obstacle problems*, J. Comput. Math. 27 (2009) 1-44. W. Briggs, V. Henson, S. McCormick, *A Multigrid Tutorial*, SIAM, 2000.

# %%
scene.finish(answer)
