# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Everyday scenes: does the solver always arrive?
#
# Scenes as a stranger would build them, with everything drawn at random: a body, its supports, its loads
# from a hundred millionth to a thousand times that of a contact of a tenth of the size, a road of any shape at
# a distance of 0 to 10 sizes, friction, a correction; at once, in load steps, or in steps of time. A judge that
# shares no code with the solvers looks at each: the optimality conditions in long double, and a conic solver
# (Clarabel) on the same matrices. Every scene ends as one of
#
# - **solved**: the judge agrees;
# - **wrong**: it does not;
# - **refused, confirmed**: a rigid motion that nothing stops is driven by the load, and the judge finds it too;
# - **refused wrongly**: it finds none;
# - **none exists, proved**: on a plane, with friction, the solver did not converge, and the judge proves that there is
#   no equilibrium: branch and bound over which nodes touch and where they slip, each case a conic programme (Clarabel)
#   that has no solution, as its dual tells;
# - **not converged**: the solver says so itself, and the judge proves nothing. Those **endless, seen twice** are among
#   them: the rigid body in a fluid, let go under Coulomb's law, ends in a motion that nothing stops, by conic programmes
#   alone: a second calculation, but no proof that there is no equilibrium elsewhere.
#
# The scenes are in the folder `everyday`. A run that is interrupted (Ctrl-C) reports the scenes that have ended, and
# the next goes on from there.

# %%
import os
from collections import Counter
from multiprocessing import current_process

import numpy as np
from everyday import outcomes
from harness.scene import Scene
from tabulate import tabulate

FINE = ("solved", "refused, confirmed", "none exists, proved")
ENDLESS = "endless, seen twice"
BAD = ("wrong", "refused wrongly", "not converged")
KINDS = {
    "frictionless, flat": lambda one: not one["friction"] and not one["curved"],
    "frictionless, curved": lambda one: not one["friction"] and one["curved"],
    "mu to 0.5, flat": lambda one: 0.0 < one["friction"] <= 0.5 and not one["curved"],
    "mu to 0.5, curved": lambda one: 0.0 < one["friction"] <= 0.5 and one["curved"],
    "mu beyond 0.5": lambda one: one["friction"] > 0.5,
}


# %%
def counted(some: list) -> Counter:
    """Return how many end as what; those seen twice to be endless have not converged."""
    count = Counter(one["outcome"] for one in some)
    count["not converged"] += count[ENDLESS]
    return count


def report() -> None:
    scene = Scene(
        "everyday_scenes", "Everyday scenes at random: solved, refused or wrong, by an independent judge."
    )
    scene.built("M", "K")
    scene.left_out("C")
    found = outcomes(
        range(300 if scene.quick else 10_000),
        min(2, os.cpu_count() or 1),
        scene.out / "outcomes.jsonl",
        scene.progress,
    )

    rows = []
    for name, belongs in KINDS.items():
        some = [one for one in found if belongs(one)]
        count = counted(some)
        rows.append([name, len(some), *(count[o] for o in (*FINE, *BAD, ENDLESS))])
        for outcome in BAD:
            scene.result(f"{outcome}[{name}]", count[outcome], "1", 0.0)
        scene.result(f"scenes[{name}]", len(some), "1")
    print(tabulate(rows, ["scenes", "number", *FINE, *BAD, ENDLESS]))
    count = counted(found)
    for outcome in BAD:
        scene.result(outcome, count[outcome], f"of {len(found)} scenes", 0.0, "wanted", "at most")
    for outcome in (FINE[2], ENDLESS):
        scene.result(outcome, count[outcome], f"of {len(found)} scenes")
    for one in found:
        if one["outcome"] in (FINE[2], ENDLESS, *BAD):
            print(f"{one['outcome']}: {one['scene']}: {one['said']}")

    solved = [one for one in found if one["outcome"] == "solved"]
    steps, flat = (
        "Newton or pivot steps",
        [one for one in solved if not one["curved"] and one["kind"] == "static"],
    )
    for key, name, words in (
        ("steps", "steps", f"{steps} in a solve"),
        ("most_steps", "steps in a small problem", f"{steps} in the longest small problem"),
        ("cycles", "cycles", "corrections"),
    ):
        counts = np.array([one[key] for one in flat if key in one])
        if not counts.size:  # outcomes of an earlier run that did not count these
            continue
        scene.result(f"median {name}", float(np.median(counts)), "1", None, f"{words} of a flat static scene")
        most = (30.0, None, "at most") if key != "cycles" else ()
        scene.result(f"most {name}", float(counts.max()), "1", *most)
        if most:
            scene.result(f"{name} > 30", float(np.mean(counts > 30)), "1", None, "part of flat static scenes")
    scene.finish(
        dofs=int(sum(one["unknowns"] for one in found)),
        contact_candidates=0,
        sweeps=0,
        cycles=int(sum(one["cycles"] for one in found)),
        work_units=0,
        solve_seconds=sum(one["seconds"] for one in found),
        residual=1e-10,
    )


# %%
if current_process().name == "MainProcess":  # the others only import what they need
    report()
