"""One scene on the ranks there are, and what each spends.

    shared_scene.py KIND REFINEMENTS MU OUT.json [CORRECTION] [alone]

Kinds: "plane" (half a cylinder, Hertz), "space" (a quarter of a ball), "strip" (a block as long as there are
ranks) and "block" (ten million unknowns after 7 refinements). The solve is timed
five times, and the shortest time counts. In one more solve the ranks wait for each other in a barrier before each
exchange: what they spend there is waiting, what follows is exchange, and the rest of the solve is computing.
With `alone` every rank solves the whole scene by itself, all at the same time: what shared memory costs.
"""

import json
import sys
import warnings
from functools import partial, wraps
from resource import RUSAGE_SELF, getrusage
from time import perf_counter, process_time

import numpy as np
from mpi4py import MPI

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_ball, half_cylinder_nested, rectangle
from geometry.exchange import Exchange
from model import BodyOnRoad, solve
from model.ranks.gathered_meshes import WholeMesh

COMM, R = MPI.COMM_WORLD, 10.0
SPENT = {"exchange": 0.0, "reduce": 0.0, "gather": 0.0, "waiting": 0.0}
COUNTS = {"messages": 0, "bytes": 0, "exchanges": 0, "reductions": 0, "gathers": 0}


def timed(cls, name, kind):
    """Let a method of a class note what it spends."""
    method = getattr(cls, name)

    @wraps(method)
    def measured(self, *arguments, **options):
        began = perf_counter()
        COMM.Barrier()
        met = perf_counter()
        answer = method(self, *arguments, **options)
        SPENT["waiting"] += met - began
        SPENT[kind] += perf_counter() - met
        if kind == "exchange":
            COUNTS["exchanges"] += 1
            COUNTS["messages"] += len(arguments[0])
            COUNTS["bytes"] += sum(values.nbytes for values in arguments[0])
        elif kind == "reduce":
            COUNTS["reductions"] += 1
        else:
            COUNTS["gathers"] += 1
        return answer

    setattr(cls, name, measured)


def pressed(body, boundary, top, force, supports, mu):
    """A body of steel, pressed on a plane."""
    elasticity = Elasticity(body, Isotropic(E=210e3, nu=0.3))
    support = supports(Support(body))
    return BodyOnRoad(elasticity.system(elasticity.total_force(top, force), support), boundary, Plane(), mu)


def scene(kind, refinements, mu, comm):
    """The scene of a kind."""
    if kind == "plane":
        body = Body.from_grid(half_cylinder_nested(R), refinements, comm=comm)
        held = partial(lambda node, s: s.fix_node(node, x=0.0), body.nearest_node((0.0, R)))
        return pressed(body, "arc", "top", (0.0, -1e4), held, mu)
    if kind == "space":
        body = Body.from_grid(half_ball(R, "quarter"), refinements, comm=comm)
        return pressed(
            body, "sphere", "top", (0.0, 0.0, -2500.0), lambda s: s.fix("x0", x=0.0).fix("y0", y=0.0), mu
        )
    length = 4.5 if kind == "block" else 4.0 * comm.size
    cells = (18, 17) if kind == "block" else (8 * comm.size, 8)
    body = Body.from_grid(rectangle(length, 4.0, *cells), refinements, comm=comm)
    return pressed(body, "bottom", "top", (0.0, -250.0 * length), lambda s: s.fix("left", x=0.0), mu)


def least(contact, correction):
    """Solve five times; return the last solution, the shortest time, and the processor time of that."""
    times = []
    for _ in range(5):
        COMM.Barrier()
        began, worked = perf_counter(), process_time()
        solution = solve(contact, correction, tolerance=1e-8, progress=False)
        times.append((perf_counter() - began, process_time() - worked))
    return solution, *min(times)


def main(kind, refinements, mu, out, correction="multigrid", alone=""):
    """Solve, and write what each rank spent."""
    comm = MPI.COMM_SELF if alone else COMM
    warnings.simplefilter("ignore")
    began = perf_counter()
    warm = scene(
        kind, 2 if kind == "space" else 3, float(mu) or None, comm
    )  # loads compiled code, off the clock
    solve(warm, correction, tolerance=1e-8, progress=False)
    contact = scene(kind, int(refinements), float(mu) or None, comm)
    built = perf_counter() - began
    solution, seconds, worked = least(contact, correction)
    memory = getrusage(RUSAGE_SELF).ru_maxrss * 1024
    timed(Exchange, "_swap", "exchange")
    for name in ("sum", "max"):
        timed(Exchange, name, "reduce")
    timed(WholeMesh, "gather", "gather")
    COMM.Barrier()
    began = perf_counter()
    solve(contact, correction, tolerance=1e-8, progress=False)
    split = perf_counter() - began
    exchange = contact.system.exchanges[0] if contact.system.exchanges else None
    N, d = solution.displacement.shape
    mine = {
        "unknowns": d * (N if exchange is None else exchange.owned),
        "candidates": int(len(contact.nodes)),
        "built": built,
        "seconds": seconds,
        "processor": worked,
        "split": split,
        "setup": solution.setup_seconds,
        "computing": split - sum(SPENT.values()),
        "memory": memory,
        **SPENT,
        **COUNTS,
    }
    ranks = COMM.gather(mine)
    touching = COMM.allreduce(int(np.count_nonzero(solution.status)))
    if COMM.rank == 0:
        found = {
            "ranks": ranks,
            "cycles": solution.cycles,
            "sweeps": solution.sweeps,
            "touching": touching,
            "residual": solution.residual,
            "levels": len(contact.system.prolongations) + 1,
            "dim": d,
        }
        with open(out, "w") as file:
            json.dump(found, file, indent=1)


if __name__ == "__main__":
    main(*sys.argv[1:])
