# %% [markdown]
# # Load paths: friction remembers
#
# **You will learn** to follow a load path, why the same loads may have different answers, and how friction makes a loop
# of force over displacement. **You need** {doc}`sticks_or_slips`: its rod on a road, pressed by $w$, pulled by $Q$.
#
# A node sticks *where the last step has left it*: each load step is a problem of its own, with that place as its reference.
# `follow` does just that. From a fresh start the end that is pulled has moved by
#
# $$ u = \frac{Q^2}{2 EA\, \mu w}. \tag{a} $$
#
# **To and fro.** Now $Q$ goes up to $Q_m$, down to $-Q_m$, and up again. When it turns, everything sticks at first; then friction has to
# change from $+\mu w$ to $-\mu w$, twice as much as before, so that the way back is (a) stretched by two in both directions (Masing):
#
# $$ u = \pm \Big( u_m - \frac{(Q_m \mp Q)^2}{4 EA\, \mu w} \Big), \qquad
#    \oint Q \, du = \frac{2 Q_m^3}{3 EA\, \mu w}. \tag{b} $$
#
# The loop is what friction takes in a cycle, as in joints and leaf springs.

# %%
import numpy as np
from harness.pictures import loops_of_force
from harness.rods import rod, rod_load, rod_problem
from harness.scene import Scene
from harness.strings import write_line

from model import follow

scene = Scene("load_paths", "A rod pulled to and fro: hysteresis, and answers that depend on the way.")
scene.built("K").left_out("M", "C", "gmsh", "UFL")
EA, w, mu, most = 1.0, 1.0, 0.5, 0.2  # N, N/m, 1, N
c = EA * mu * w
bar = rod(41, EA)
problem = rod_problem(bar, w, 0.0, mu)


def along(path):  # of (part of w, Q)
    solutions = list(follow(problem, [rod_load(bar, part * w, Q) for part, Q in path], tolerance=1e-12))
    return solutions, np.array([solution.displacement[-1, 0] for solution in solutions])


up = np.linspace(0, most, 13)[1:]
there, back, again = up, np.linspace(most, -most, 25)[1:], np.linspace(-most, most, 25)[1:]
Q = np.concatenate([there, back, again])
solutions, u = along([(1.0, q) for q in Q])
end = most**2 / (2 * c)
exact = [there**2 / (2 * c), end - (most - back) ** 2 / (4 * c), (most + again) ** 2 / (4 * c) - end]
exact = np.concatenate(exact)
taken = np.trapezoid(Q[11:], u[11:])  # from Q_m to Q_m
limits = max((abs(s.contact_force[:, 0]) - mu * s.pressure_force).max() for s in solutions)
scene.result("displacement[Q_m]", u[11], "m", end, "eq. (a)")
scene.result("largest_error_of_the_loop", np.abs(u - exact).max() / end, "of that", 0.0, "eq. (b), all steps")
scene.result("taken_in_a_cycle", taken, "J", 2 * most**3 / (3 * c), "eq. (b), by trapezia")
scene.result("max_coulomb_violation", max(limits, 0.0), "N", 0.0, "eq. (7)")

# %% [markdown]
# **Two ways to the same loads.** Press with $w$ and pull with $Q_m$. Or press with half of $w$, pull with $Q_m$, and only then press with the
# other half. In the second way slip reaches twice as far, by (a) the end comes twice as far, and no pressure afterwards brings it
# back: friction, now stronger than it need be, just holds.

# %%
straight, first = along([(1.0, q) for q in up])
detour, second = along([(0.5, q) for q in up] + [(1.0, most)])
scene.result("displacement[w, then Q]", first[-1], "m", end, "eq. (a)")
scene.result("displacement[w/2, then Q, then w]", second[-1], "m", 2 * end, "eq. (a) for w/2")
same = [answer[-1].contact_force.sum(axis=0) for answer in (straight, detour)]
scene.result("difference_of_the_loads", np.abs(same[0] - same[1]).max(), "N", 0.0, "the same loads")
names = ("w, then Q", "w/2, then Q, then w")
lines = {name: -way[-1].contact_force[:, 0] / bar.share for name, way in zip(names, (straight, detour))}
scene.figure(loops_of_force(Q, u, exact, bar.x, lines, mu * w), "load_paths")
write_line(scene.out / "rod.xdmf", bar.x, solutions[-1], solutions[-1].pressure_force / bar.share)
rod_problem(bar, w, most, mu).save(scene.out / "problem.npz", straight[-1])
scene.finish(solutions[-1])

# %% [markdown]
# So a result with friction is a result *of a path*: say which, and look whether it stays if the steps are halved. The next
# lesson, {doc}`section_3_1_2_tangential_loading`, does all this with a cylinder.
#
# **In ParaView**, open `rod.xdmf`, use *Plot Over Line* on `contact_force`: the last turn has left its trace along the rod.
#
# ## Exercises
#
# 1. How many steps does a monotone pull need? And the way there and back?
# 2. Pull under $w/2$ and let go under $w$, ten times. Does the rod walk along the road?
# 3. What is left of $u$ when $Q$ is back at 0 for the first time? What must $Q$ be for the end to be back at 0?
#
# **Further reading.** G. Masing, *Eigenspannungen und Verfestigung beim Messing*, Proc. 2nd Int. Congr. Appl. Mech., Zürich, 1926,
# 332-335. L. E. Goodman, J. H. Klumpp, *Analysis of slip damping*, J. Appl. Mech. 23 (1956) 421-429. J. R. Barber,
# *Contact Mechanics*, Springer, 2018, chapter 9.

# %% tags=["hide-cell"]
# 1. One, since all slip goes the same way: a step sees where it ends. There and back: one for each turn.
assert np.allclose(along([(1.0, most), (1.0, 0.0)])[1], [end, end / 2])
# 2. By its first pull only: from then on it comes back each time to where it was, and nothing slips any further.
_, walked = along([(0.5, 0.0), *((0.5, q) for q in up[3::4]), (1.0, most), (1.0, 0.0)] * 10)
print("after each pull:", walked[4::6].round(4), "after each release:", walked[5::6].round(4))
# 3. Half of it, by (b); and 0 = u_m - (Q_m - Q)^2 / (4 c) gives Q = Q_m (1 - sqrt(2)).
assert abs(along([(1.0, q) for q in (most, most * (1 - np.sqrt(2)))])[1][-1]) < 0.01 * end
