# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

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
# that fits into $m$ free nodes loses $1 - |G| \approx (\pi / (m + 1))^2$: halve the mesh width, and it takes four times as many sweeps.

# %%
import matplotlib.pyplot as plt
import numpy as np
from harness.scene import Scene
from numba import njit

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder_nested
from model import BodyOnRoad, NotConverged, solve

scene = Scene("why_relaxation_crawls", "What the loop does to short and long waves, and what multigrid adds.")
scene.built("K")
scene.left_out("M", "C", "friction", "gmsh")

# %% [markdown]
# ## The string on the road, by the loop
#
# With the road, the loop first finds out which nodes touch and then has the same waves before it, on the nodes that
# are free.


# %%
@njit
def relax(K, b, lower, u):
    """Sweep once over all nodes, each above its bound (the paper's eq. 9)."""
    for i in range(len(b)):
        u[i] = max(u[i] + (b[i] - K[i] @ u) / K[i, i], lower[i])


def string(n, T=1.0, q=2.0, d=0.2, L=2.0):
    """Return stiffness, load and bound of a string of n nodes above a road."""
    h = L / (n + 1)
    K = (T / h) * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    return K, np.full(n, -q * h), np.full(n, -d)


def residual(K, b, lower, u):
    """Largest force without a road to carry it, of the load of a node."""
    r = K @ u - b
    return np.abs(np.where(u == lower, np.minimum(r, 0.0), r)).max() / np.abs(b).max()


def steps(step, u, tolerance=1e-8):
    """Take steps from u, in place, until the residual is below the tolerance; return the residuals."""
    problem, history = string(len(u)), []
    while not history or history[-1] > tolerance:
        step(*problem, u)
        history.append(residual(*problem, u))
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


def cycle(K, b, lower, u):
    """One cycle of truncated multigrid: the loop decides contact, coarser strings take out what is smooth."""
    relax(K, b, lower, u)
    touches, J = u == lower, lambda v: 0.5 * v @ (K @ v) - b @ v
    P = interpolation(len(u))
    P[touches] = 0
    r = b - K @ u
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
    return np.maximum(interpolation(n) @ u, string(n)[2])


meshes = (31, 63, 127, 255)
sweeps = {n: steps(relax, from_below(n)) for n in meshes}
cycles = {n: steps(cycle, from_below(n)) for n in (*meshes, 511)}
for n in cycles:
    print(
        f"{n:4d} nodes: {len(sweeps[n]) if n in sweeps else '':>6} sweeps alone, {len(cycles[n]):3d} cycles"
    )
loss, expected = 1 - sweeps[255][-1] / sweeps[255][-2], (np.pi / 58) ** 2  # 57 nodes are free at each end
scene.result("loss_in_a_sweep[n=255]", loss, "of the error", expected, "eq. (a)")
scene.result("cycles[n=31]", len(cycles[31]), "1")
scene.result("cycles[n=511]", len(cycles[511]), "1", len(cycles[255]), "as many as with half the nodes")

# %%
figure, axes = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
theta = np.linspace(0, np.pi, 200)
axes[0].plot(theta, np.abs(np.exp(1j * theta) / (2 - np.exp(-1j * theta))), "k-")
axes[0].axvspan(np.pi / 2, np.pi, color="0.9")
axes[0].text(2.35, 0.8, "a coarser mesh\ncannot see these", ha="center", fontsize=9)
axes[0].set(
    xlabel=r"$\theta$: phase from node to node",
    ylabel="what a sweep leaves, $|G|$",
    title="eq. (a)",
    ylim=(0, 1.02),
)
for n, style in zip(meshes, ("-", "--", "-.", ":")):
    axes[1].semilogy(sweeps[n], "k", ls=style, label=f"{n} nodes")
    axes[2].semilogy(
        range(1, len(cycles[n]) + 1), cycles[n], "k", ls=style, marker="o", ms=3, label=f"{n} nodes"
    )
axes[1].set(xlabel="sweeps", ylabel="residual", title="the loop alone", xscale="log")
axes[2].set(
    xlabel="cycles, two sweeps of the fine string each", ylabel="residual", title="truncated multigrid"
)
axes[1].legend(fontsize=8)
axes[2].legend(fontsize=8)
scene.figure(figure, "sweeps_and_cycles")

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
    system = support.apply(elasticity.stiffness(), elasticity.total_force("top", (0.0, -1e4)))
    return BodyOnRoad(elasticity, system, Plane(), "arc", reach=3.0)


levels, found = range(2, 5) if scene.quick else range(2, 7), []
for k in levels:
    pressed = cylinder(k)
    answer = solve(pressed.problem, "multigrid", tolerance=1e-8)
    try:
        solve(pressed.problem, "none", tolerance=1e-8, limit=10)
    except NotConverged as stopped:  # as it must
        alone = stopped
    found.append((answer.displacement.size, answer.cycles, alone.residual))
    print(
        f"{found[-1][0]:6d} unknowns: {answer.cycles} cycles; the loop alone: residual {alone.residual:.0e}",
        end=" ",
    )
    print(f"after {alone.sweeps} sweeps")
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
def careless(K, b, lower, u):
    """Correct all nodes, and put on the road what ends below it."""
    relax(K, b, lower, u)
    P, J = interpolation(len(u)), lambda v: 0.5 * v @ (K @ v) - b @ v
    r = np.where((u == lower) & (b < K @ u), 0.0, b - K @ u)  # forces that the road carries are no residual
    c, t, before = P @ correction(coarse(K, P), P.T @ r), 1.0, J(u)
    while t > 1e-6 and J(np.maximum(u + t * c, lower)) > before:
        t /= 2
    if t > 1e-6:
        u[:] = np.maximum(u + t * c, lower)
    relax(K, b, lower, u)


print("without truncation:", {n: len(steps(careless, from_below(n))) for n in meshes[:2]}, "cycles")

# 3. The first correction throws nearly the whole string on the road, and a sweep lets go of a node only once its
# neighbour is free: the edge of the contact moves by a node or two a cycle.
print("from u = 0:", {n: len(steps(cycle, np.zeros(n))) for n in meshes}, "cycles")


# 4. One or two: the start is already as good as the next coarser mesh allows.
def nested(n, cycles_each):
    """Return the largest error of u against the solution on the same string, and that of the mesh."""
    u = np.zeros(3)
    for level in [2**k - 1 for k in range(3, int(np.log2(n + 1)) + 1)]:
        problem = string(level)
        u = np.maximum(interpolation(level) @ u, problem[2])
        for _ in range(cycles_each):
            cycle(*problem, u)
    true = from_below(n)
    steps(cycle, true, 1e-11)
    x = 2.0 * np.arange(1, n + 1) / (n + 1)
    exact = -0.2 + np.maximum(np.sqrt(0.2) - np.minimum(x, 2 - x), 0) ** 2
    return np.abs(u - true).max(), np.abs(true - exact).max()


for each in (1, 2, 3):
    algebraic, of_the_mesh = nested(255, each)
    print(f"{each} cycle(s) a string: algebraic error {algebraic:.0e}, of the mesh {of_the_mesh:.0e}")

# 5. Two sweeps on n nodes, and on n/2, n/4, ...: about 4, and as much again for residuals and transfers; in the
# plane 2 (1 + 1/4 + ...) = 8/3, in space 16/7.
print("sweeps of the finest mesh in a V(1,1) cycle:", [round(2 / (1 - 0.5**dim), 2) for dim in (1, 2, 3)])

# %% [markdown]
# ## Further reading
#
# - A. Brandt and C. Cryer, *Multigrid algorithms for the solution of linear complementarity problems arising from free
#   boundary problems*, SIAM J. Sci. Stat. Comput. 4 (1983) 655-684.
# - R. Kornhuber, *Monotone multigrid methods for elliptic variational inequalities I*, Numer. Math. 69 (1994) 167-184.
# - C. Gräser and R. Kornhuber, *Multigrid methods for obstacle problems*, J. Comput. Math. 27 (2009) 1-44.
# - W. Briggs, V. Henson and S. McCormick, *A Multigrid Tutorial*, 2nd ed., SIAM, 2000.

# %%
scene.finish(answer)
