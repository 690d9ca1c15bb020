"""A block on a belt, held by a spring, in its quick form: Coulomb at the end, equilibrium at every step."""

DEMO = "prescribed_motion"


def test_quick_demo(quick):
    results = quick.results
    assert abs(results["Q_over_N"] / 0.5 - 1) < 1e-6
    assert abs(results["platen_way"] / quick.summary["results"]["platen_way"]["reference"] - 1) < 1e-6
    assert results["spring_off"] < 1e-9 and results["sheet_open_by"] < 1e-8
    assert (quick.out / "belt.png").stat().st_size > 10_000
    assert (quick.out / "belt.xdmf").exists()
