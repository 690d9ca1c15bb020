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

import numpy as np
from extremes import CASES
from tabulate import tabulate

from model.files import write_aside
from model.judge import judge
from model.scene import Scene

scene = Scene("extreme_cases", "Stiff and extreme cases: right, refused or wrong.")
scene.built("M", "C", "K")
scene.left_out("gmsh")

# %%
chosen = [case for case in CASES if not (case.long and scene.quick)]
verdicts = [judge(case) for case in scene.progress(chosen, "cases")]
with write_aside(scene.out / "verdicts.csv") as aside, open(aside, "w", newline="", encoding="utf-8") as file:
    table = csv.writer(file)
    table.writerow(["family", "case", "outcome", "error", "tolerance", "residual", "seconds", "words"])
    for v in verdicts:
        table.writerow(
            [v.case.family, v.case.name, v.outcome, v.error, v.case.tolerance, v.residual, v.seconds, v.words]
        )

# %%
families = {}
for v in verdicts:
    families.setdefault(v.case.family, []).append(v)
rows = []
for family, members in families.items():
    counts = [sum(v.outcome == outcome for v in members) for outcome in ("right", "refused", "wrong")]
    errors = [v.error for v in members if np.isfinite(v.error)]
    residuals = [v.residual for v in members if np.isfinite(v.residual)]
    rows.append([family, len(members), *counts, max(errors), max(residuals), sum(v.seconds for v in members)])
    scene.result(f"worst_error[{family}]", max(errors), "1", 0.0, "largest of the family's cases")
print(
    tabulate(
        rows,
        ["family", "cases", "right", "refused", "wrong", "worst error", "residual", "seconds"],
        floatfmt=".2g",
    )
)
for v in verdicts:
    if v.outcome == "wrong":
        print(
            f"Wrong: {v.case.family}, {v.case.name}: error {v.error:.1e}, residual {v.residual:.1e}. {v.words}"
        )
for column, name in enumerate(("cases", "right", "refused", "wrong"), start=1):
    scene.result(name, sum(row[column] for row in rows), "1", 0.0 if name == "wrong" else None)

# %%
scene.cost(
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
