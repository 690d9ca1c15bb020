# %% [markdown]
# # A node and a spring: the loop by hand
#
# **You will learn** what the contact conditions say, how one node fulfils them, and how a loop over nodes that each
# look after themselves solves a problem of many: thirty lines of numpy. **You need** Hooke's law, and no finite elements.
#
# A mass hangs on a spring of stiffness $k$, its lower side a distance $g_0$ above a road, and a force $b$ acts on it,
# upwards positive. The road can push with a force $p$. Then
#
# $$ k u = b + p, \qquad g = g_0 + u, \tag{a} $$
# $$ g \ge 0, \qquad p \ge 0, \qquad p\, g = 0: \tag{5, 6, b} $$
#
# the node not below the road, the road not pulling, and not pushing from afar. (Numbers are those of the paper that this
# course follows.) *Suppose the node is free*; if it ends below the road, put it there, and (a) gives the force. One of
# the two always fits, and never both, save for $g = p = 0$.

# %%
import numpy as np
from harness.pictures import presses_or_hangs, string_on_the_road
from harness.scene import Scene
from harness.strings import contact_problem, string, write_string

from model import solve

scene = Scene("node_and_spring", "The contact loop by hand: a node on a spring, and a string on a road.")
scene.built("K").left_out("M", "C", "friction", "gmsh", "UFL")


def one_node(k, b, g0):
    u = max(b / k, -g0)  # free, or put on the road
    return u, k * u - b  # and the force of the road


loads = np.linspace(-2, 0, 101)
scene.figure(presses_or_hangs(loads, [one_node(1.0, b, 1.0) for b in loads], 1.0), "one_node")

# %% [markdown]
# **Many nodes: the loop.** A string under tension $T$ hangs a depth $d$ above a road, and a load $q$ per length pulls it down.
# Its nodes, $h$ apart, feel their neighbours: row $i$ of $K u = b + p$ has $2 T / h$ for itself and $-T / h$ for each. The
# loop visits node after node, holds all others where they are, and lets the node do what a single one does:
#
# $$ \bar u_i = \max\!\Big( \tilde u_i + \tfrac{1}{K_{ii}} (b_i - K_{ij} \tilde u_j),\ -g_i^0 \Big). \tag{9} $$
#
# Each visit minimises $J(u) = \tfrac12 u \cdot K u - b \cdot u$ over the one $u_i$ that may move: $J$ falls until no node alone can
# better it, and for this convex $J$ over these bounds no node alone means no nodes at all. A free string is a parabola, $T u''
# = q$, and meets the road without a kink, which would need a single force that pulls. So it comes down over the length $s$:
#
# $$ \tfrac{q}{2 T} s^2 = d, \qquad s = \sqrt{2 T d / q}, \qquad p(x) = q \text{ for } s < x < L - s. \tag{c} $$


# %%
def loop(K, b, g0, sweeps, order=range, omega=1.0):
    u, history = np.zeros(len(b)), []  # the largest error of equilibrium after each sweep
    for _ in range(sweeps):
        for i in order(len(b)):
            u[i] = max(u[i] + omega * (b[i] - K[i] @ u) / K[i, i], -g0[i])
        p = np.where(u == -g0, np.maximum(K @ u - b, 0.0), 0.0)
        history.append(np.abs(K @ u - b - p).max())
    return u, p, np.array(history)


cord, d, s = string(31), 0.2, np.sqrt(0.2)  # T = 1 N, q = 2 N/m, L = 2 m
K, b, g0 = cord.K, cord.b, -cord.lower
u, p, history = loop(K, b, g0, sweeps=250)
solution = solve(contact_problem(cord), tolerance=1e-12)  # the same with this package
off = np.abs(solution.displacement[:, 1] - u).max()
scene.result("contact_begins", cord.x[p > 0][0], "m", s, "eq. (c), within one h")
scene.result("largest_error_of_u", np.abs(u - cord.exact).max() / d, "d", 0.0, "eq. (c), of order h^2")
scene.result("equilibrium_error", history[-1], "N", 0.0, "K u = b + p")
scene.result("min_gap", (g0 + u).min(), "m", 0.0, "eq. (5)")
scene.result("min_force", p.min(), "N", 0.0, "eq. (6)")
scene.result("package_against_hand", off / d, "d", 0.0, "the loop above")
scene.figure(string_on_the_road(cord, u, p, history), "string")
write_string(scene.out / "string.xdmf", cord, solution)
contact_problem(cord).save(scene.out / "problem.npz", solution)
scene.finish(solution)

# %% [markdown]
# Every gap and every force is exactly right in sign, though the loop was never told which nodes touch. It also crawls:
# {doc}`why_relaxation_crawls` asks why. **In ParaView**, open `string.xdmf` and `string_road.xdmf`, use *Warp By Vector* on
# `displacement`, and colour by `contact_pressure`.
#
# ## Exercises
#
# 1. Both $g = 0$ and $p = 0$: for which $b$ is that so for the single node, and what do small changes of $b$ do?
# 2. Visit the string's nodes backwards, or in a random `order`. Does the answer depend on it? Does the number of sweeps?
# 3. Multiply each correction by $\omega = 1.45$ (successive over-relaxation). Why is it allowed, and what does it save?
#
# **Further reading.** C. Cryer, *The solution of a quadratic programming problem using systematic overrelaxation*, SIAM J.
# Control 9 (1971) 385-392: the loop, and its proof. P. Wriggers, *Computational Contact Mechanics*, Springer, 2006.

# %% tags=["hide-cell"]
# 1. At b = -k g0. A little more load presses, a little less lifts: the answer is continuous there, with a kink.
assert np.allclose([one_node(1.0, -1.0 + e, 1.0) for e in (-0.1, 0.0, 0.1)], [[-1, 0.1], [-1, 0], [-0.9, 0]])
# 2. and 3. The minimum is one and the same; the way to it is not. J falls for any 0 < omega < 2.
shuffled, backward = np.random.default_rng(1).permutation, lambda n: range(n)[::-1]
for order, factor in ((range, 1.0), (backward, 1.0), (shuffled, 1.0), (range, 1.45)):
    w, _, errors = loop(K, b, g0, 250, order, factor)
    print("sweeps to ten digits:", 1 + np.argmax(errors < 1e-10))
    assert np.allclose(w, u, atol=1e-8)
