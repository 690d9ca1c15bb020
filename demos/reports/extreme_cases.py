# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # Stiff and extreme: what holds, and what is refused
#
# Small scenes, each with one thing driven to its extreme, and judged by machine:
#
# - **right**: the error against a closed form, a scaling law or an independent solver is within the case's
#   tolerance, and the natural residual below 1e-10;
# - **refused**: one sentence says at once why the case makes no sense;
# - **wrong**: anything else, be it a wrong number, no number, a traceback, or no convergence.
#
# The cases are in the folder `extremes`, a file for each family, and read as `name, values, what must hold`.

# %%
import csv

import matplotlib.pyplot as plt
import numpy as np
from extremes import CASES
from extremes.incompressible import RATIOS, against_hertz
from extremes.random_scenes import random_faults
from harness.scene import Scene
from harness.verdict import judge
from matplotlib.colors import ListedColormap
from tabulate import tabulate

from model.atomic_file import write_aside

scene = Scene("extreme_cases", "Stiff and extreme cases: right, refused or wrong.")
scene.built("M", "C", "K").left_out("gmsh")

# %%
chosen = [case for case in CASES if not (case.long and scene.quick)]
verdicts = [judge(case) for case in scene.progress(chosen, "cases")]
with write_aside(scene.out / "verdicts.csv") as aside, open(aside, "w", newline="", encoding="utf-8") as file:
    table = csv.writer(file)
    table.writerow(["family", "case", "outcome", "error", "tolerance", "residual", "seconds", "words"])
    for v in verdicts:
        case = v.case
        table.writerow(
            [case.family, case.name, v.outcome, v.error, case.tolerance, v.residual, v.seconds, v.words]
        )

# %% [markdown]
# ## What became of them
#
# Errors are measured as each case says: 1e-10 and less where a scaling law or a turned scene must give the
# same digits, percents where Hertz's half space is the reference, and in between where the data themselves
# are rounded (positions a million lengths away, cells ten thousand times as high as wide).

# %%
families = {}
for v in verdicts:
    families.setdefault(v.case.family, []).append(v)
rows = []
for family, members in families.items():
    counts = [sum(v.outcome == outcome for v in members) for outcome in ("right", "refused", "wrong")]
    errors = [v.error for v in members if v.outcome == "right"]
    residuals = [v.residual for v in members if v.outcome == "right"]
    rows.append([family, len(members), *counts, max(errors), max(residuals), sum(v.seconds for v in members)])
    scene.result(f"worst_error[{family}]", max(errors), "1", 0.0, "largest of the family's right cases")
head = ["family", "cases", "right", "refused", "wrong", "worst error", "residual", "seconds"]
print(tabulate(rows, head, floatfmt=".2g"))
for v in verdicts:
    if v.outcome == "wrong":
        print(
            f"Wrong: {v.case.family}, {v.case.name}: error {v.error:.1e}, residual {v.residual:.1e}. {v.words}"
        )
for column, name in enumerate(("cases", "right", "refused", "wrong"), start=1):
    scene.result(name, sum(row[column] for row in rows), "1", 0.0 if name == "wrong" else None)

# %%
WIDE = 40  # cases in a line of the picture
strips = [(f if not k else "", m[k : k + WIDE]) for f, m in families.items() for k in range(0, len(m), WIDE)]
errors = np.full((len(strips), WIDE), np.nan)
figure, axes = plt.subplots(figsize=(9.0, 0.26 * len(strips) + 1.4), layout="constrained")
for line, (_, members) in enumerate(strips):
    for place, v in enumerate(members):
        if v.outcome == "right":
            errors[line, place] = np.log10(max(v.error, 1e-16))
        else:
            axes.text(
                place, line, "r" if v.outcome == "refused" else "W", ha="center", va="center", fontsize=7
            )
greys = ListedColormap(plt.get_cmap("Greys")(np.linspace(0.08, 0.85, 256)))
picture = axes.imshow(errors, cmap=greys, aspect="auto", vmin=-16, vmax=-1)
axes.set_yticks(range(len(strips)), [family for family, _ in strips])
axes.set_xlabel("case; r: refused, W: wrong")
axes.set_title("log10 of the error of every right case")
axes.set_xticks(np.arange(WIDE + 1) - 0.5, minor=True)
axes.set_yticks(np.arange(len(strips) + 1) - 0.5, minor=True)
axes.grid(which="minor", color="white", linewidth=0.7)
axes.tick_params(which="minor", length=0)
figure.colorbar(picture)
scene.figure(figure, "errors")

# %% [markdown]
# ## Random scenes, random nonsense
#
# Blocks and thrown rings with everything drawn at random must be right; values that make no sense must be
# refused in a sentence that names them.

# %%
scenes, inputs = (60, 500) if scene.quick else (2000, 2000)
faults = random_faults(scenes, inputs, scene.progress)
for fault in faults:
    print(f"Wrong: {fault}")
scene.result("random_scenes", scenes, "1")
scene.result("random_inputs", inputs, "1")
scene.result("random_wrong", len(faults), "1", 0.0, "every scene right, every input refused")

# %% [markdown]
# ## Locking
#
# Plain bilinear elements have too many constraints where nothing may change its volume: they lock, and the
# pressure oscillates. One dilatation a cell (B-bar) is the remedy.

# %%
for nu in RATIOS[:3]:
    for remedy, name in ((False, "plain"), (True, "one dilatation a cell")):
        error, residual = against_hertz(nu, remedy)
        scene.result(f"error_against_hertz[nu={nu:g}, {name}]", error, "1", 0.0, "p0, and p in L2, E*")

# %%
scene.cost(  # the cases keep their seconds and residuals only, so that nothing else can be told
    dofs=0,
    contact_candidates=0,
    sweeps=0,
    cycles=0,
    work_units=0,
    assembly_seconds=0.0,
    solve_seconds=sum(v.seconds for v in verdicts),
    residual=max(row[6] for row in rows),
)
scene.finish()
