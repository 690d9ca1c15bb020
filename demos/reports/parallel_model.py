"""What a cycle costs on many ranks: a model of computing, messages and sums, fitted to measured runs."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.optimize import nnls

COARSEST = 3_000  # unknowns of the first mesh that is gathered, about
UPDATES = 3  # exchanges on each level of a cycle: after both sweeps, and of restricted defects
MENDED = {
    "calls of compiled code": "fewer and longer calls: a level's sweep, transfer and exchange in one",
    "messages": "coarse meshes on fewer ranks (agglomeration)",
    "bytes": "sweeping inner nodes while values travel; cycles in single precision",
    "sums over all ranks": "pipelined Krylov methods, or V-cycles alone",
    "the coarsest mesh": "gathering it in stages, on part of the ranks",
}


class ParallelModel:
    """Time of a cycle on P ranks, from runs on two.

    Parameters
    ----------
    runs : sequence
        What `shared_scene.py` writes of scenes of several sizes on two ranks.

    Attributes
    ----------
    computing, calls : float
        Seconds an unknown and cycle, both cores at work; and seconds a cycle, however few the unknowns.
    latency, per_byte : float
        Seconds a message, and a byte.
    per_sum, sums : float
        Seconds of a sum over two ranks, and sums a cycle.
    gather : float
        Seconds a cycle to gather and to solve the coarsest mesh.
    """

    def __init__(self, runs: Sequence[dict[str, Any]]):
        self.dim = runs[0]["dim"]
        ranks = [(rank, run["cycles"]) for run in runs for rank in run["ranks"]]
        computing = [rank["computing"] / cycles for rank, cycles in ranks]
        self.computing, self.calls = fit(
            computing, [rank["unknowns"] for rank, _ in ranks], [1.0] * len(ranks)
        )
        names = ("exchange", "messages", "bytes")
        self.latency, self.per_byte = fit(*([rank[name] for rank, _ in ranks] for name in names))
        self.per_sum = float(np.mean([r["reduce"] / max(r["reductions"], 1) for r, _ in ranks]))
        self.sums = float(np.mean([r["reductions"] / c for r, c in ranks]))
        self.gather = float(np.mean([r["gather"] / c for r, c in ranks]))

    def terms(self, n: float, P: float) -> dict[str, float]:
        """Return what a cycle of n unknowns spends on P ranks, by kind, in seconds."""
        d = self.dim
        levels = max(1, round(np.log(n / COARSEST) / np.log(2**d)))
        sizes = n / 2.0 ** (d * np.arange(levels))
        neighbours = 0 if P == 1 else min(P - 1, 3**d - 1)
        sides = 0.0 if P == 1 else min(2 * d, P - 1)
        surface = 8 * d * sides * (sizes / d / P) ** ((d - 1) / d)
        return {
            "computing": self.computing * n / P,
            "calls of compiled code": self.calls,
            "messages": self.latency * UPDATES * levels * neighbours,
            "bytes": self.per_byte * UPDATES * float(surface.sum()),
            "sums over all ranks": self.per_sum * self.sums * np.log2(P),
            "the coarsest mesh": self.gather * np.log2(P),
        }

    def cycle(self, n: float, P: float) -> float:
        """Return the time of a cycle of n unknowns on P ranks (s)."""
        return sum(self.terms(n, P).values())

    def efficiency(self, n: float, P: float) -> float:
        """Return the part of the time of a cycle that is computing."""
        return self.terms(n, P)["computing"] / self.cycle(n, P)

    def end_of_scaling(self, n: float) -> tuple[int, str]:
        """Return the ranks at which half of the time is no computing, and what takes most of it."""
        P = 2
        while P < 2**24 and self.efficiency(n, P) > 0.5:
            P *= 2
        rest = {name: spent for name, spent in self.terms(n, P).items() if name != "computing"}
        return P, max(rest, key=lambda name: rest[name])


def fit(spent: Sequence[float], *counts: Sequence[float]) -> np.ndarray:
    """Return the costs >= 0 of each kind whose sum comes nearest to what was spent, relatively."""
    costs, times = np.column_stack(counts).astype(float), np.asarray(spent)
    scale = costs.max(axis=0)
    return nnls(costs / scale / times[:, None], np.ones(times.size))[0] / scale
