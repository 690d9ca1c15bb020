"""The report of error against run time, in its quick form."""

DEMO = "reports/error_against_run_time"


def test_quick_report(quick):
    out, summary, results = quick.out, quick.summary, quick.results
    cycles = [value for key, value in results.items() if key.startswith(("cycles[dofs", "cycles[friction"))]
    assert len(cycles) > 4 and max(cycles) <= 16
    assert max(cycles) - min(cycles) <= 2
    assert max(value for key, value in results.items() if key.startswith("cycles[algebraic")) <= 25
    assert max(value for key, value in results.items() if key.startswith("cycles_per_step[time")) <= 6
    assert abs(results["p0[mesh-converged]"] / 8559 - 1) < 0.005
    assert results["cost_ratio_to_linear_solve"] < 3.0
    assert results["triad_bandwidth"] > 0.0
    assert (
        len([key for key in results if key.startswith("bandwidth[")]) == 18
    )  # nine kernels, plane and space
    assert {"numpy", "PETSc"} <= set(summary["machine"]["blas"]) or "system" in summary["machine"]["blas"]
    dofs = summary["cost"]["dofs"]
    for name in ("vinewtonrsls + MUMPS", "GPCG + MUMPS", "BNLS + MUMPS"):
        assert results[f"seconds[{name}, dofs={dofs}]"] > 0.0
    assert {key for key in results if key.startswith("did_not_converge")} <= {
        f"did_not_converge[{name}, dofs=498]" for name in ("BLMVM", "BQPIP + MUMPS", "vinewtonssls + MUMPS")
    }
    for scene in ("cylinder", "cube"):
        penalties = [k for k in results if k.startswith("penetration[penalty=") and scene in k]
        depths = [results[key] for key in penalties]
        assert len(depths) == 3 and depths == sorted(depths, reverse=True) and depths[-1] > 0.0
    assert summary["cost"]["residual"] <= 1e-8
    for name in (
        "algebraic_error.png",
        "error_against_run_time.png",
        "seconds_per_unknown.png",
        "hertz.xdmf",
        "problem.npz",
    ):
        assert (out / name).stat().st_size > 1000
