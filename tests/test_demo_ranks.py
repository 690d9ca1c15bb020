"""The study of many ranks, in its quick form."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

DEMO = "reports/ranks"
HERE = str(Path(sys.executable).parent)
pytestmark = pytest.mark.skipif(
    not (shutil.which("mpirun", path=HERE) or shutil.which("mpirun")), reason="there is no mpirun here"
)


def test_quick_study(quick):
    results = quick.results
    for kind in ("plane", "space"):
        label = f"{kind},mu=0.3,2 ranks"
        assert results[f"more_cycles[{label}]"] <= 4
        parts = ("computing", "exchange", "reduce", "gather", "waiting")
        assert abs(sum(results[f"share_of_{part}[{label}]"] for part in parts) - 1.0) < 1e-9
        efficiencies = [
            results[f"projected_efficiency[{kind},1e+09 unknowns,{P} ranks]"] for P in (16, 128, 1024)
        ]
        assert 0.0 <= efficiencies[2] <= efficiencies[1] <= efficiencies[0] <= 1.0
    assert quick.summary["cost"]["residual"] <= 1e-8
    assert (quick.out / "projection.png").stat().st_size > 10_000


def test_the_model_finds_what_it_is_made_of():
    from parallel_model import ParallelModel

    def run(unknowns, messages, sizes):
        rank = {"unknowns": unknowns, "computing": 1e-8 * unknowns * 10, "messages": messages, "bytes": sizes}
        rank |= {
            "exchange": 1e-5 * messages + 1e-9 * sizes,
            "reduce": 1e-3,
            "reductions": 100,
            "gather": 0.01,
        }
        return {"dim": 3, "cycles": 10, "ranks": [rank, rank]}

    model = ParallelModel([run(10_000, 300, 1e6), run(100_000, 400, 6e6)])
    found = np.array([model.computing, model.latency, model.per_byte, model.per_sum])
    assert np.allclose(found, [1e-8, 1e-5, 1e-9, 1e-5])
    assert model.efficiency(1e9, 2) > model.efficiency(1e7, 1024)
