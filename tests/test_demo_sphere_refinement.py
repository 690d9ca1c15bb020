"""The study of the sphere's meshes, in its quick form."""

DEMO = "reports/sphere_refinement"


def test_quick_study(quick):
    results = quick.results
    assert all(value <= 20 for key, value in results.items() if key.startswith("cycles[dofs"))
    assert results["order[pressure (L2)]"] > 0.5
    differences = [value for key, value in results.items() if key.startswith("difference[")]
    assert differences and max(differences) < 1e-6
    for name in ("refinement", "pressure", "error_against_run_time"):
        assert (quick.out / f"{name}.png").stat().st_size > 10_000
