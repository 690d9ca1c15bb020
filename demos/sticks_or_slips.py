# %% [markdown]
# # Sticks or slips: friction by hand
#
# **You will learn** Coulomb's law at a node, what the loop does with it, and how slip eats its way into a rod that is
# pulled along a road. **You need** {doc}`node_and_spring`. The node may now move along the road too, $u = (u_t, u_n)$, with a stiffness matrix $k$ that couples both directions.
# The road answers with the force $(\tau, p)$:
#
# $$ k u = b + (\tau, p), \qquad |\tau| \le \mu p, \qquad \tau \text{ opposes the slip where } |\tau| = \mu p. \tag{7} $$
#
# The recipe grows by two lines. *Free?* If not: *does it stick* where it was? If that takes more than $\mu p$: *it slips*,
# with $\tau = \pm\mu p$ and $u_n = -g_0$, where the row of $u_t$ gives $u_t$, and $p$ is that after the slip.

# %%
import numpy as np
from harness.pictures import slip_in_a_rod, sticks_then_slips
from harness.rods import rod, rod_problem
from harness.scene import Scene
from harness.strings import write_line

from model import solve

scene = Scene("sticks_or_slips", "Friction by hand: a node, and a rod that is pulled along a road.")
scene.built("K").left_out("M", "C", "gmsh", "UFL")


def one_node_with_friction(k, b, g0, mu, stuck_at=0.0):
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
# **Many nodes.** A rod of stiffness $EA$ and length $L$ lies on a road, pressed by $w$ per length, and is pulled at its right end
# by $Q < \mu w L$. From there slip eats its way in, as far as friction takes to hold $Q$:
#
# $$ EA\, u'' = \mu w, \qquad s = \frac{Q}{\mu w}, \qquad u(x) = \frac{\mu w}{2 EA} (x - L + s)^2 \text{ for } x > L - s, \tag{a} $$
#
# and nothing moves further left. In the loop each node takes what force it must to stay where it was, up to $\mu w h$.


# %%
def drag(K, b, limit, sweeps):
    u = np.zeros(len(b))
    for i in list(range(len(b))) * sweeps:
        pull = b[i] - K[i] @ u + K[i, i] * u[i]  # on node i, if it stays at 0
        u[i] = (pull - np.clip(pull, -limit[i], limit[i])) / K[i, i]
    return u, K @ u - b  # and the friction


EA, w, mu, Q = 1.0, 1.0, 0.5, 0.3  # N, N/m, 1, N
bar, limit = rod(21, EA), mu * w * rod(21).share
u, tau = drag(bar.K, np.append(np.zeros(20), Q), limit, sweeps=2500)
solution = solve(rod_problem(bar, w, Q, mu), tolerance=1e-12)  # the same with this package
exact = mu * w / (2 * EA) * np.maximum(bar.x - 1 + Q / (mu * w), 0) ** 2
off = np.abs(solution.displacement[:, 0] - u).max() / exact[-1]
scene.result("last_that_sticks", bar.x[u < 1e-12][-1], "m", 1 - Q / (mu * w), "eq. (a), within one h")
scene.result("displacement_of_the_end", u[-1], "m", Q**2 / (2 * EA * mu * w), "eq. (a)")
scene.result("largest_error_of_u", np.abs(u - exact).max() / exact[-1], "of the end's", 0.0, "eq. (a)")
scene.result("friction_beyond_mu_p", max((np.abs(tau) / limit).max() - 1, 0.0), "of mu p", 0.0, "eq. (7)")
scene.result("package_against_hand", off, "of the end's", 0.0, "the loop above")
scene.figure(slip_in_a_rod(bar, u, tau, exact, mu * w), "rod")
write_line(scene.out / "rod.xdmf", bar.x, solution, solution.pressure_force / bar.share)
rod_problem(bar, w, Q, mu).save(scene.out / "problem.npz", solution)
scene.finish(solution)

# %% [markdown]
# **In ParaView**, open `rod.xdmf`, colour by `status` (2 sticks, 1 slips), and plot `contact_force` with *Plot Over Line*.
#
# ## Exercises
#
# 1. Pull the single node to 1.5 and let go. Does it come back to where it started? *Hint: `stuck_at`.*
# 2. Of the work that $Q$ does on the rod, how much is kept as strain, and how much does friction take?
# 3. With $k = ((1, 0.8), (0.8, 1))$, $\mu = 1.5$, $g_0 = 0$ and $b = (-1, -0.7)$ a node may be free. May it stick as well? And slip?
#
# **Further reading.** K. L. Johnson, *Contact Mechanics*, Cambridge, 1985, chapter 7. A. Klarbring, *Examples of non-uniqueness
# and non-existence of solutions to quasistatic contact problems with friction*, Ingenieur-Archiv 60 (1990) 529-541.

# %% tags=["hide-cell"]
# 1. It slides back only until friction, mu p, holds what is left of the springs' pull: friction remembers.
slid, *_ = one_node_with_friction(k, np.array([1.5, -2.0]), 1.0, mu=0.5)
back, force, now = one_node_with_friction(k, np.array([0.0, -2.0]), 1.0, mu=0.5, stuck_at=slid[0])
print(f"pulled to u_t = {slid[0]:.3f}; released: {now} to u_t = {back[0]:.3f}, tau = {force[0]:.3f}")
# 2. Half and half: Q^3 / (6 EA mu w) each.
assert np.allclose([0.5 * u @ bar.K @ u, -tau @ u], Q**3 / (6 * EA * mu * w), rtol=0.01)
# 3. All three fulfil every condition: Coulomb's law need not have one solution only ({doc}`open_questions`).
k, b, mu = np.array([[1.0, 0.8], [0.8, 1.0]]), np.array([-1.0, -0.7]), 1.5
p = (0.8 * b[0] - b[1]) / (1 - 0.8 * mu)  # slips to the left, tau = mu p
assert np.linalg.solve(k, b)[1] > 0 and abs(b[0]) < -mu * b[1] and p > 0 > b[0] + mu * p
