"""Sweeps grow with the mesh as the analysis says, cycles do not."""

import numpy as np

DEMO = "why_relaxation_crawls"


def test_quick_demo(quick):
    out, results = quick.out, quick.results
    assert abs(results["loss_in_a_sweep[n=255]"] / (np.pi / 58) ** 2 - 1) < 0.05
    assert results["cycles[n=511]"] <= 12
    assert results["cycles[finest]"] <= results["cycles[coarsest]"] + 3
    assert results["residual_of_the_loop_alone[finest]"] > 1e-3
    sweeps = [len(quick.names["sweeps"][n]) for n in quick.names["meshes"]]
    assert all(finer > 2.5 * coarser for coarser, finer in zip(sweeps, sweeps[1:]))
    for name in ("sweeps_and_cycles.png", "pressed.xdmf", "problem.npz"):
        assert (out / name).stat().st_size > 1000
