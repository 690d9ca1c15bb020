"""What friction's refinement shows, in its quick form."""

DEMO = "reports/friction_refinement"


def test_quick_demo(quick):
    out, results = quick.out, quick.results
    assert results["steps_that_failed"] == 0
    assert results["cycles_over_frictionless"] <= 2.0
    assert results["order_in_h[tau (L2)]"] > 1.0
    assert results["error_of_ten_steps[u (energy norm)]"] < 0.005
    assert results["order_in_steps[u (energy norm)]"] > 0.0
    ratios = [value for key, value in results.items() if key.startswith("c_over_a[")]
    assert len(ratios) == 6
    assert all(abs(ratio / 0.941 - 1) < 0.09 for ratio in ratios)  # Spence, within a node of this mesh
    for name in ("mesh_refinement.png", "step_refinement.png", "self_similarity.png", "cycles.png"):
        assert (out / name).stat().st_size > 1000
