"""The study of Cattaneo and Mindlin's traction, in its quick form: closer on the finer mesh."""

DEMO = "reports/tangential_refinement"


def test_quick_study(quick):
    results = quick.results
    coarse, fine = (results[f"c_over_a[uncoupled, {count} quads]"] for count in (760, 3584))
    assert abs(coarse / 0.5 - 1) < 0.04
    assert abs(fine / 0.5 - 1) < 0.02
    errors = [results[f"tau_L2_error[uncoupled, {count} quads]"] for count in (760, 3584)]
    assert errors[1] < errors[0]
    assert (quick.out / "refinement.png").stat().st_size > 1000
