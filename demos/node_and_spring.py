# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # A node and a spring: the loop by hand
#
# **You will learn** what the contact conditions say, how one node fulfils them, and how a loop over nodes that each
# look after themselves solves a problem of many: thirty lines of numpy. **You need** Hooke's law, and no finite elements.
#
# ## One node
#
# A mass hangs on a spring of stiffness $k$, its lower side a distance $g_0$ above a road, and a force $b$ acts on it,
# upwards positive. The road can push with a force $p$. Then
#
# $$ k u = b + p, \qquad g = g_0 + u, \tag{a} $$
# $$ g \ge 0, \tag{5} $$
# $$ p \ge 0, \tag{6} $$
# $$ p\, g = 0. \tag{b} $$
#
# (5): the node is not below the road. (6): the road does not pull. (b): it does not push from afar. The numbers are
# those of the paper that this course follows; it does not print (b), but its flowchart does nothing else. To solve
# them, *suppose the node is free*, and look whether it ends below the road; if so, put it there, and (a) gives the
# force. One of the two always fits, and never both, save for $g = p = 0$.

# %%
import numpy as np
from harness.pictures import sticks_then_slips, string_on_the_road
from harness.scene import Scene
from harness.strings import string
from scipy import sparse

from model import ContactProblem, solve

scene = Scene("node_and_spring", "The contact loop by hand: a node on a spring, and a string on a road.")
scene.built("K")
scene.left_out("M", "C", "gmsh", "UFL")


def one_node(k, b, g0):
    """Return displacement of the node and force of the road."""
    u = max(b / k, -g0)
    return u, k * u - b


for b in (-0.5, -1.0, -2.0):
    u, p = one_node(k=1.0, b=b, g0=1.0)
    print(f"b = {b:4.1f}:  u = {u:4.1f},  g = {1 + u:3.1f},  p = {p:3.1f}")

# %% [markdown]
# ## One node that may stick or slip
#
# Now the node can move along the road too, $u = (u_t, u_n)$, with a stiffness matrix $k$ that couples both
# directions, and friction on the road: the force $(\tau, p)$ obeys
#
# $$ |\tau| \le \mu p, \qquad \tau \text{ opposes the slip where } |\tau| = \mu p. \tag{7} $$
#
# The recipe grows by two lines. *Free?* If not: *does it stick* where it was ($u_t$ as before)? If that takes more
# than $\mu p$: *it slips*, with $\tau = \pm\mu p$ and $u_n = -g_0$, where the row of $u_t$ gives $u_t$. The pressure
# is the one after the slip, since slipping changes it through $k_{nt}$.


# %%
def one_node_with_friction(k, b, g0, mu, stuck_at=0.0):
    """Return displacement (u_t, u_n), force (tau, p) and status of the node."""
    u = np.linalg.solve(k, b)
    if u[1] >= -g0:
        return u, np.zeros(2), "free"
    u = np.array([stuck_at, -g0])
    force = k @ u - b
    if abs(force[0]) <= mu * force[1]:
        return u, force, "stick"
    sign = np.sign(force[0])  # k_tt u_t + k_tn u_n - b_t = sign mu (k_nt u_t + k_nn u_n - b_n)
    right = b[0] - sign * mu * b[1] - (k[0, 1] - sign * mu * k[1, 1]) * u[1]
    u[0] = right / (k[0, 0] - sign * mu * k[1, 0])
    return u, k @ u - b, "slip"


k, pulls = np.array([[2.0, 0.2], [0.2, 1.0]]), np.linspace(0, 2, 201)
ways, forces, _ = zip(*(one_node_with_friction(k, np.array([pull, -2.0]), 1.0, mu=0.5) for pull in pulls))
scene.figure(sticks_then_slips(pulls, np.array(ways), np.array(forces), mu=0.5), "one_node")

# %% [markdown]
# ## Many nodes: the loop
#
# A string under tension $T$ hangs over a road, a depth $d$ above it, and a load $q$ per length pulls it down. Its nodes,
# a distance $h$ apart, feel their neighbours: row $i$ of $K u = b + p$ has $2 T / h$ for itself and $-T / h$ for each. The
# loop visits node after node, holds all others where they are, and lets the node do what a single one does:
#
# $$ \bar u_i = \max\!\Big( \tilde u_i + \tfrac{1}{K_{ii}} (b_i - K_{ij} \tilde u_j),\ -g_i^0 \Big). \tag{9} $$
#
# Without the road that is Gauss and Seidel's iteration. With it, it still goes downhill: each visit minimises
# $J(u) = \tfrac12 u \cdot K u - b \cdot u$ over the one $u_i$ that is allowed to move, so that $J$ falls until nobody
# can better it alone; for this $J$, convex, over these bounds, nobody alone means nobody at all. That is the whole proof.
#
# A free string is a parabola with $T u'' = q$. It meets the road without a kink, for a kink would need a single force that
# pulls. So it comes down over the length $s$ with $\tfrac{q}{2 T} s^2 = d$, and from there on the road carries the load:
#
# $$ s = \sqrt{2 T d / q}, \qquad p(x) = q \text{ for } s < x < L - s. \tag{c} $$
#
# The nodal forces over $h$ are that pressure; the node at the edge carries the part of it that is in contact in its cell.


# %%
def loop(K, b, g0, sweeps, order=range, omega=1.0):
    """Relax in some order from u = 0; return u, forces p, and the largest error of equilibrium after each sweep."""
    u, history = np.zeros(len(b)), []
    for _ in range(sweeps):
        for i in order(len(b)):
            u[i] = max(u[i] + omega * (b[i] - K[i] @ u) / K[i, i], -g0[i])
        p = np.where(u == -g0, np.maximum(K @ u - b, 0.0), 0.0)
        history.append(np.abs(K @ u - b - p).max())
    return u, p, np.array(history)


n, d, s = 31, 0.2, np.sqrt(0.2)  # T = 1 N, q = 2 N/m, L = 2 m
cord = string(n)
K, b, g0 = cord.K, cord.b, -cord.lower
u, p, history = loop(K, b, g0, sweeps=250)
scene.result("contact_begins", cord.x[p > 0][0], "m", s, "eq. (c), within one h")
scene.result("largest_error_of_u", np.abs(u - cord.exact).max() / d, "d", 0.0, "eq. (c), of order h^2")
scene.result("equilibrium_error", history[-1], "N", 0.0, "K u = b + p")
scene.result("min_gap", (g0 + u).min(), "m", 0.0, "eq. (5)")
scene.result("min_force", p.min(), "N", 0.0, "eq. (6)")
scene.figure(string_on_the_road(cord, u, p, history), "string")

# %% [markdown]
# The loop ends with every gap and every force exactly right in sign, though it was never told which nodes touch. It
# also crawls: 134 sweeps to ten digits, for fourteen nodes that are free. {doc}`why_relaxation_crawls` asks why.
#
# ## The same with this package
#
# `ContactProblem` takes any symmetric matrix, in blocks of two or three unknowns a node; here the first unknown of each
# is held, by a lone diagonal entry. `solve` is the same loop, with a correction that takes the crawling out.


# %%
def contact_problem(cord):
    """Give every node a second unknown, along the road, that is held."""
    n, aside, up = len(cord.b), np.array([1.0, 0.0]), np.array([0.0, 1.0])
    A = sparse.csr_array(np.kron(cord.K, np.diag(up)) + np.kron(np.eye(n), np.diag(aside)))
    load, places, normals = np.outer(cord.b, up), np.outer(cord.x, aside), np.tile(up, (n, 1))
    return ContactProblem(A, load, places, np.arange(n), normals, -cord.lower)


problem = contact_problem(cord)
solution = solve(problem, tolerance=1e-12)
off = np.abs(solution.displacement[:, 1] - u).max() / d
scene.result("package_against_hand", off, "d", 0.0, "the loop above")
problem.save(scene.out / "problem.npz", solution)

# %% [markdown]
# ## Exercises
#
# 1. Both $g = 0$ and $p = 0$: for which $b$ is that so for the single node, and what do small changes of $b$ do?
# 2. Pull the node with friction to 1.5 and let go. Does it come back to where it started? *Hint: `stuck_at`.*
# 3. Visit the string's nodes backwards, or in a random `order`. Does the answer depend on it? Does the number of sweeps?
# 4. Multiply each correction by $\omega = 1.45$ (successive over-relaxation). Why is it allowed, and what does it save?
# 5. How does the error against (c) fall with $h$, and why not like it would without contact?

# %% tags=["hide-cell"]
# 1. At b = -k g0. A little more load presses (p grows by as much), a little less lifts (g grows by 1/k as much):
# the answer is continuous there, but has a kink.
kink = np.array([one_node(1.0, -1.0 + change, 1.0) for change in (-1e-3, 0.0, 1e-3)])
assert np.allclose(kink, [[-1.0, 1e-3], [-1.0, 0.0], [-0.999, 0.0]])

# 2. It slides back only until friction, mu p, holds what is left of the springs' pull: friction remembers.
slid, _, was = one_node_with_friction(k, np.array([1.5, -2.0]), 1.0, mu=0.5)
back, force, now = one_node_with_friction(k, np.array([0.0, -2.0]), 1.0, mu=0.5, stuck_at=slid[0])
print(f"{was} at u_t = {slid[0]:.3f}; released: {now} at u_t = {back[0]:.3f}, tau = {force[0]:.3f}")

# 3. and 4. The minimum is one and the same; the way to it is not. J falls for any 0 < omega < 2.
shuffled, backward = np.random.default_rng(1).permutation, lambda n: range(n)[::-1]
for order, factor in ((range, 1.0), (backward, 1.0), (shuffled, 1.0), (range, 1.45)):
    w, _, errors = loop(K, b, g0, 250, order, factor)
    assert np.allclose(w, u, atol=1e-8)
    print("sweeps to ten digits:", 1 + np.argmax(errors < 1e-10))

# 5. The edge of the contact lies within a cell, so that the error goes up and down under a line of order 2.
for cord in map(string, (31, 63, 127, 255)):
    error = np.abs(solve(contact_problem(cord), tolerance=1e-12).displacement[:, 1] - cord.exact).max() / d
    print(f"{len(cord.b):4d} nodes: error {error:.1e} d, over h^2: {error * (len(cord.b) + 1) ** 2:.2f}")

# %% [markdown]
# **Further reading.** C. Cryer, *The solution of a quadratic programming problem using systematic overrelaxation*, SIAM J.
# Control 9 (1971) 385-392: the loop, and its proof. R. Glowinski, *Numerical Methods for Nonlinear Variational Problems*,
# Springer, 1984, chapters I and V. P. Wriggers, *Computational Contact Mechanics*, 2nd ed., Springer, 2006.

# %%
scene.finish(solution)
