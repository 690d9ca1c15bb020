"""A ball from an Abaqus file, in its quick form: Hertz's pressure and patch, names, balance."""

DEMO = "own_mesh"


def test_quick_demo(quick):
    results, references = quick.results, quick.summary["results"]
    assert abs(results["p0"] / references["p0"]["reference"] - 1) < 0.025
    assert abs(results["last_in_contact"] / references["last_in_contact"]["reference"] - 1) < 0.1
    assert abs(results["contact_force"] / 15e3 - 1) < 1e-8
    assert set(quick.names["body"].facets) == {"Ball", "Axis", "top"}
    assert (quick.out / "pressure.png").stat().st_size > 10_000
    assert (quick.out / "ball.xdmf").exists()
