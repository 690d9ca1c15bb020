"""The study of normal loading, in its quick form: loop against correction, orders, Hertz's own error."""

DEMO = "reports/normal_loading_refinement"


def test_quick_study(quick):
    results = quick.results
    assert results["error_p0[correction=none]"] < 1e-8
    assert results["order_p0"] > 1.0
    assert results["hertz_model_error[load=0.1]"] < results["hertz_model_error[load=1]"] / 2
    assert abs(results["p0[mesh-converged, uniform]"] / 8570.66 - 1) < 0.005
    for name in ("refinement_h.png", "refinement_run_time.png", "hertz_model_error.png"):
        assert (quick.out / name).stat().st_size > 1000
