# %% [markdown]
# # And why multigrid does not: by hand
#
# **You will learn** how coarser meshes take care of the errors that the loop hardly touches, what contact changes about
# that, and what it costs: a truncated multigrid method of thirty lines. **You need** {doc}`why_relaxation_crawls`.
#
# After a sweep the error $e$ is *smooth*, so that a string of half as many nodes can represent it. Without a road, with $r = b - K u$,
#
# $$ K e = r, \qquad e \approx P c, \qquad (P^T K P)\, c = P^T r, \qquad u \leftarrow u + P c, \tag{a} $$
#
# where $P$ interpolates: each coarse node reaches half way to the next. The small problem is of the same kind: take it down by the same
# method, until three nodes are left. That is a *V(1,1) cycle*, one sweep on the way down and one on the way up.

# %%
from functools import partial

import numpy as np
from harness import string_multigrid
from harness.pictures import what_a_cycle_does
from harness.scene import Scene
from harness.sources import show_source
from harness.string_multigrid import coarse, correction, cycle, from_below, interpolation, relax, steps
from harness.strings import contact_problem, string, write_string

from model import solve

scene = Scene("multigrid_by_hand", "Truncated multigrid for a string on a road, in thirty lines.")
scene.built("K").left_out("M", "C", "friction", "gmsh", "UFL")
show_source(interpolation, correction)

# %% [markdown]
# **With a road** only contact needs care, in two places.
#
# - A coarse node reaches over several fine ones. Some of those touch and must not move: their rows of $P$ are set to
#   zero, and the coarse matrix is that of the *truncated* $P$. What the road carries is no residual.
# - The correction may carry other nodes into the road. They are put back on it, and the step $t$ is halved until
#   $J(u) = \tfrac12 u \cdot K u - b \cdot u$ has not grown, which carries the proof of convergence over from the loop alone:
#
# $$ u \leftarrow \max(u + t\, P c,\ -g^0), \qquad J(\text{new}) \le J(\text{old}). \tag{b} $$

# %%
show_source(coarse, cycle)

# %% [markdown]
# **What a sweep does, and a cycle**: random errors of 2 cm on the free nodes of a string of 63, and then the residuals cycle by cycle,
# on finer and finer strings, from what the next coarser string says (*nested iteration*), which knows about where the contact ends.

# %%
cord, exact = string(63), string_multigrid.nested(63, tolerance=1e-12)
errors, noise = {}, np.random.default_rng(2).uniform(-0.02, 0.02, 63) * (exact > cord.lower)
for name, take in {"at first": [], "after a sweep": [relax], "after a cycle": [cycle]}.items():
    u = np.maximum(exact + noise, cord.lower)
    for step in take:
        step(cord.K, cord.b, cord.lower, u)
    errors[name] = u - exact
histories = {n: steps(cycle, from_below(n)) for n in (31, 63, 127, 255, 511)}
for n, history in histories.items():
    scene.result(f"cycles[n={n}]", len(history), "1", 12, "wanted", "at most")
for step in ("sweep", "cycle"):
    left = np.abs(errors[f"after a {step}"]).max() / np.abs(noise).max()
    scene.result(f"left_by_a_{step}", left, "of the error")
scene.result("largest_error_of_u[n=63]", np.abs(exact - cord.exact).max() / 0.2, "d", 0.0, "the parabola")
scene.figure(what_a_cycle_does(cord.x, errors, histories), "cycles")
solution = solve(contact_problem(cord), tolerance=1e-12)
off = np.abs(solution.displacement[:, 1] - exact).max() / 0.2
scene.result("package_against_hand", off, "d", 0.0, "the cycles above")
write_string(scene.out / "string.xdmf", cord, solution)
contact_problem(cord).save(scene.out / "problem.npz", solution)
scene.finish(solution)

# %% [markdown]
# The package does the same in the plane and in space, with friction too, with conjugate gradients around the cycles, and computes
# only those coarse rows anew whose nodes changed. **In ParaView**, open `string.xdmf`, *Warp By Vector*, colour by `status`.
#
# ## Exercises
#
# 1. Leave out the truncation, so that all nodes may be corrected and are then put back on the road. What becomes of the cycles?
# 2. Start from $u = 0$ instead. How does the number of cycles grow, and what takes them so long?
# 3. With nested iteration, how many cycles a string are enough for the error to be that of its mesh?
# 4. A cycle costs about how many sweeps of the finest string?
#
# **Further reading.** A. Brandt, C. Cryer, *Multigrid algorithms for the solution of linear complementarity problems arising
# from free boundary problems*, SIAM J. Sci. Stat. Comput. 4 (1983) 655-684. R. Kornhuber, *Monotone multigrid methods for
# elliptic variational inequalities I*, Numer. Math. 69 (1994) 167-184. C. Gräser, R. Kornhuber, *Multigrid methods for
# obstacle problems*, J. Comput. Math. 27 (2009) 1-44.

# %% tags=["hide-cell"]
# 1. They still converge, since the sweeps do, but much of each correction is cut off again:
careless = partial(cycle, truncate=False)
print("without truncation:", {n: len(steps(careless, from_below(n))) for n in (31, 63)}, "cycles")
# 2. The first correction throws nearly the whole string on the road, whose edge then moves by a node or two a cycle:
print("from u = 0:", {n: len(steps(cycle, np.zeros(n))) for n in (31, 63, 127, 255)}, "cycles")
# 3. Two: the start is already as good as the next coarser mesh allows.
true = string_multigrid.nested(255, tolerance=1e-11)
print(f"the mesh is off by {np.abs(true - string(255).exact).max():.0e} m")
for each in (1, 2, 3):
    print(f"{each} a string: off by {np.abs(string_multigrid.nested(255, each) - true).max():.0e} m")
# 4. Two sweeps on n nodes, and on n/2, n/4, ...: about 4, and as much again for residuals and transfers; in the
# plane 2 (1 + 1/4 + ...) = 8/3, in space 16/7.
print("sweeps of the finest mesh in a V(1,1) cycle:", [round(2 / (1 - 0.5**dim), 2) for dim in (1, 2, 3)])
