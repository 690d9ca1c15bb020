# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # The same script on many ranks: what scales, and what ends it
#
# Scenes of `shared_scene.py` on one rank and on as many as the machine has cores, by `mpirun`: strong scaling
# (one mesh), weak scaling (a block as long as there are ranks). The time of a solve is split by rank into
# computing, exchange and waiting; `parallel_model.py` fits a model to it and projects that to machines which
# are not here. Speed-ups are those of run times, and beside them those of processor time, which a busy machine
# disturbs less; what a rank spends waiting in MPI counts there as work.

# %%
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
from harness.scene import Scene
from parallel_model import MENDED, ParallelModel

from model.figures.figures import new_figure

scene = Scene("ranks", "The same script on many ranks: what scales, and what ends it.")
scene.built("K").left_out("M", "C", "gmsh", "pyvista")
HERE = Path(__file__).parent
LAUNCHER = shutil.which("mpirun", path=str(Path(sys.executable).parent)) or shutil.which("mpirun")
PARTS = ("computing", "exchange", "reduce", "gather", "waiting")
CORES = 2 if scene.quick else min(len(os.sched_getaffinity(0)), 16)


@scene.assembly
def run(kind, refinements, mu, ranks, correction="multigrid", petsc="", alone=""):
    """What each rank of a scene spent, and what the solve cost; `alone` if each solves all of it."""
    out = scene.out / f"{kind}_{refinements}_{mu}_{ranks}_{correction}{alone}.json"
    script = [sys.executable, "-m", "mpi4py", str(HERE / "shared_scene.py")]
    command = [
        LAUNCHER,
        "-n",
        str(ranks),
        *script,
        kind,
        str(refinements),
        str(mu),
        str(out),
        correction,
        alone,
    ]
    paths = [str(HERE.parents[1]), os.environ.get("PYTHONPATH", "")]
    threads = {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    environment = os.environ | threads | {"PYTHONPATH": os.pathsep.join(paths), "PETSC_OPTIONS": petsc}
    done = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{kind} on {ranks} ranks failed: {done.stderr[-500:]}")
    return json.loads(out.read_text())


def seconds(found, kind="seconds"):
    """Time of the solve, of the rank that took longest."""
    return max(rank[kind] for rank in found["ranks"])


def unknowns(found):
    """Unknowns of all ranks."""
    return sum(rank["unknowns"] for rank in found["ranks"])


# %% [markdown]
# ## Strong scaling, with and without friction

# %%
if LAUNCHER is None:
    raise FileNotFoundError(
        "There is no mpirun beside this Python or on the path; install MPICH or Open MPI."
    )
LARGE = {"plane": 3, "space": 1} if scene.quick else {"plane": 6, "space": 4}
cases = [(kind, mu) for kind in LARGE for mu in ((0.3,) if scene.quick else (0.0, 0.3))]
ranks = sorted({1, 2, CORES})
strong = {}
for kind, mu in scene.progress(cases, "strong scaling"):
    strong[kind, mu] = [run(kind, LARGE[kind], mu, P) for P in ranks]
    alone, *shared = strong[kind, mu]
    for P, found in zip(ranks[1:], shared):
        label = f"{kind},mu={mu},{P} ranks"
        wanted = {"reference": 1.7, "source": "wanted", "bound": "at least"} if P == 2 else {}
        scene.result(f"speed_up[{label}]", seconds(alone) / seconds(found), "1", **wanted)
        less = seconds(alone, "processor") / seconds(found, "processor")
        scene.result(f"speed_up_of_processor_time[{label}]", less, "1")
        more = found["cycles"] - alone["cycles"]
        scene.result(f"more_cycles[{label}]", more, "1", 2, "wanted", "at most")
        whole = sum(rank["split"] for rank in found["ranks"])
        setups = [max(rank["setup"] for rank in those["ranks"]) for those in (alone, found)]
        scene.result(f"speed_up_of_setup[{label}]", setups[0] / setups[1], "1")
        after = [seconds(those) - setup for those, setup in zip((alone, found), setups)]
        scene.result(f"speed_up_after_setup[{label}]", after[0] / after[1], "1")
        for part in PARTS:
            spent = sum(rank[part] for rank in found["ranks"])
            scene.result(f"share_of_{part}[{label}]", spent / whole, "1")
        memory = max(rank["memory"] for rank in found["ranks"])
        scene.result(f"peak_memory_of_a_rank[{label}]", memory / 2**30, "GiB")
    beside = seconds(run(kind, LARGE[kind], mu, CORES, alone="alone"))
    scene.result(f"slower_side_by_side[{kind},mu={mu},{CORES} solves]", beside / seconds(alone), "1")
    scene.result(f"unknowns[{kind}]", unknowns(alone), "1")
    scene.result(f"seconds[{kind},mu={mu},1 rank]", seconds(alone), "s")
    scene.result(f"peak_memory[{kind},mu={mu},1 rank]", alone["ranks"][0]["memory"] / 2**30, "GiB")

# %%
picture, axes = new_figure("", "part of the run time (1)", size=(6.4, 4.4))
bars = {
    f"{kind}\nmu={mu}\nrank {r}": [rank[part] / rank["split"] for part in PARTS]
    for (kind, mu), found in strong.items()
    for r, rank in enumerate(found[-1]["ranks"])
}
below = np.zeros(len(bars))
for k, part in enumerate(PARTS):
    heights, grey = [parts[k] for parts in bars.values()], str(0.25 + 0.17 * k)
    axes.bar(list(bars), heights, bottom=below, color=grey, edgecolor="k", label=part)
    below += heights
axes.set_ylim(0.0, 1.0)
axes.tick_params(axis="x", labelsize=6)
axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(PARTS), fontsize=7)
scene.figure(picture, "split")

# %% [markdown]
# ## Weak scaling: a strip as long as there are ranks

# %%
refinements = () if scene.quick else (4, 5)
weak = {(level, P): run("strip", level, 0.3, P) for level in refinements for P in ranks}
for level in refinements:
    each = [seconds(weak[level, P]) / weak[level, P]["cycles"] for P in ranks]
    for P, spent in zip(ranks[1:], each[1:]):
        label = f"strip,{unknowns(weak[level, 1])} unknowns a rank,{P} ranks"
        scene.result(f"efficiency[{label}]", each[0] / spent, "1")

# %% [markdown]
# ## A model, and where it says that scaling ends
#
# A cycle costs, on P ranks and n unknowns,
#
# $$t = a \frac nP + c + \alpha\, m + \frac{b}{\beta} + \lambda\, r \log_2 P + g,$$
#
# with c for calls of compiled code, m messages and b bytes of the exchanges on all levels (surfaces of parts of equal sides), r sums over all
# ranks, and g for the coarsest mesh, which every rank gathers and solves.

# %%
below = () if scene.quick else (4, 5)
fitted = {"plane": [run("plane", level, 0.3, 2) for level in below] + [strong["plane", 0.3][1]]}
below = () if scene.quick else (2, 3)
fitted["space"] = [run("space", level, 0.3, 2) for level in below] + [strong["space", 0.3][1]]
picture, axes = new_figure("ranks P", "time of a cycle (s)", size=(6.4, 4.4))
styles = iter(("k-", "k--", "k:", "k-."))
for kind, found in fitted.items():
    model = ParallelModel(found)
    scene.result(f"model_computing[{kind}]", model.computing * 1e9, "ns an unknown and cycle")
    scene.result(f"model_calls[{kind}]", model.calls * 1e3, "ms a cycle")
    scene.result(f"model_latency[{kind}]", model.latency * 1e6, "us a message")
    scene.result(f"model_bytes[{kind}]", model.per_byte * 1e9, "ns a byte")
    scene.result(f"model_sum[{kind}]", model.per_sum * 1e6, "us a sum and log2 P")
    off = max(abs(model.cycle(unknowns(f), 2) / (seconds(f, "split") / f["cycles"]) - 1) for f in found)
    scene.result(f"model_off_by[{kind}]", 100 * off, "%")
    for n in (1e7, 1e9):
        for P in (16, 128, 1024):
            label = f"{kind},{n:.0e} unknowns,{P} ranks"
            scene.result(f"projected_efficiency[{label}]", model.efficiency(n, P), "1")
            scene.result(f"projected_cycle[{label}]", model.cycle(n, P), "s")
        all_ranks = 2.0 ** np.arange(15)
        label = f"{kind}, {n:.0e} unknowns"
        axes.loglog(all_ranks, [model.cycle(n, P) for P in all_ranks], next(styles), label=label)
        end, term = model.end_of_scaling(n)
        mended = f"mended by {MENDED[term]}"
        scene.result(f"half_efficiency_at[{label}, by {term}]", end, "ranks", source=mended)
axes.legend()
scene.figure(picture, "projection")

# %% [markdown]
# ## What PETSc says of itself
#
# The corrections `algebraic` and `direct` are PETSc's. Its own account of a run, by event and by rank, is
# switched on from outside, for any script:
#
#     PETSC_OPTIONS="-log_view :petsc.txt" mpirun -n 2 python -m mpi4py script.py
#
# Here of the half cylinder by `algebraic`; the table is left beside this report as petsc.txt.

# %%
level = 2 if scene.quick else 5
report = scene.out / "petsc.txt"
by_petsc = run("plane", level, 0.0, 2, "algebraic", f"-log_view :{report}")
native = run("plane", level, 0.0, 2)
label = f"plane,mu=0.0,{unknowns(native)} unknowns,2 ranks"
scene.result(f"seconds[{label},multigrid]", seconds(native), "s")
scene.result(f"seconds[{label},algebraic]", seconds(by_petsc), "s")
events = [line.split() for line in report.read_text().splitlines()] if report.exists() else []
for name in ("KSPSolve", "PCSetUp", "PCApply"):
    line = next((words for words in events if words[:1] == [name]), None)
    if line:
        scene.result(f"petsc_seconds[{name}, five solves and one more]", float(line[3]), "s")

# %% [markdown]
# ## Ten million unknowns
#
# Friction on 10,035,970 unknowns in the plane, on two ranks. That takes 17 GiB and some minutes, and
# is left out where less is free.


# %%
def free_memory():
    """Bytes of memory that a new program may have."""
    lines = Path("/proc/meminfo").read_text().splitlines()
    return 1024 * int(next(line for line in lines if line.startswith("MemAvailable")).split()[1])


if not scene.quick and free_memory() > 18 * 2**30:
    largest = run("block", 7, 0.3, 2)
    label = f"{unknowns(largest)} unknowns,mu=0.3,2 ranks"
    memory = sum(rank["memory"] for rank in largest["ranks"])
    scene.result(f"peak_memory[{label}]", memory / 2**30, "GiB")
    scene.result(f"seconds[{label}]", seconds(largest), "s")
    scene.result(f"cycles[{label}]", largest["cycles"], "V(1,1)")
    scene.result(f"residual[{label}]", largest["residual"], "1", 1e-8, "tolerance", "at most")
else:
    print("Ten million unknowns are left out: they take 18 GiB of free memory, and not --quick.")

# %%
last = strong["space", 0.3][-1]
scene.finish(
    dofs=unknowns(last),
    contact_candidates=sum(rank["candidates"] for rank in last["ranks"]),
    sweeps=last["sweeps"],
    cycles=last["cycles"],
    work_units=0.0,
    solve_seconds=seconds(last),
    residual=max(f["residual"] for group in strong.values() for f in group),
)
