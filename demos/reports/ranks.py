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
# are not here.

# %%
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
from harness.scene import Scene
from parallel_model import ParallelModel

from model.figures.figures import new_figure

scene = Scene("ranks", "The same script on many ranks: what scales, and what ends it.")
scene.built("K").left_out("M", "C", "gmsh", "pyvista")
HERE = Path(__file__).parent
LAUNCHER = shutil.which("mpirun", path=str(Path(sys.executable).parent)) or shutil.which("mpirun")
CORES = 2 if scene.quick else min(len(os.sched_getaffinity(0)), 16)


@scene.assembly
def run(kind, refinements, mu, ranks):
    """What each rank of a scene spent, and what the solve cost."""
    out = scene.out / f"{kind}_{refinements}_{mu}_{ranks}.json"
    script = [sys.executable, "-m", "mpi4py", str(HERE / "shared_scene.py")]
    command = [LAUNCHER, "-n", str(ranks), *script, kind, str(refinements), str(mu), str(out)]
    paths = [str(HERE.parents[1]), os.environ.get("PYTHONPATH", "")]
    threads = {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    environment = os.environ | threads | {"PYTHONPATH": os.pathsep.join(paths)}
    done = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{kind} on {ranks} ranks failed: {done.stderr[-500:]}")
    return json.loads(out.read_text())


def seconds(found):
    """Time of the solve."""
    return max(rank["seconds"] for rank in found["ranks"])


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
        more = found["cycles"] - alone["cycles"]
        scene.result(f"more_cycles[{label}]", more, "1", 2, "wanted", "at most")
        whole = sum(rank["seconds"] for rank in found["ranks"])
        for part in ("computing", "exchange", "reduce", "gather", "waiting"):
            spent = sum(rank[part] for rank in found["ranks"])
            scene.result(f"share_of_{part}[{label}]", spent / whole, "1")
        memory = max(rank["memory"] / rank["unknowns"] for rank in found["ranks"])
        scene.result(f"memory[{label}]", memory / 1e3, "kB an unknown")
    scene.result(f"unknowns[{kind}]", unknowns(alone), "1")
    scene.result(f"seconds[{kind},mu={mu},1 rank]", seconds(alone), "s")

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
    off = max(abs(model.cycle(unknowns(f), 2) / (seconds(f) / f["cycles"]) - 1) for f in found)
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
        scene.result(f"half_efficiency_at[{label}, by {term}]", end, "ranks")
axes.legend()
scene.figure(picture, "projection")

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
