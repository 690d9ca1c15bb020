"""The sphere on the plane, in its quick form: Hertz, Mindlin, and files that VTK reads."""

import pytest

pyvista = pytest.importorskip("pyvista")
DEMO = "sphere_on_plane"


def test_quick_sphere(quick):
    out, summary = quick.out, quick.summary
    results, cost = summary["results"], summary["cost"]
    for key in ("p0", "a"):
        fine = results[f"{key}[dofs={cost['dofs']}]"]
        assert fine["value"] == pytest.approx(fine["reference"], rel=0.02)
    for part in (0.25, 0.5, 0.75):
        ratio = results[f"c_over_a[Q={part} mu F]"]
        assert ratio["value"] == pytest.approx(ratio["reference"], rel=0.03)
    assert all(r["value"] <= 20 for key, r in results.items() if key.startswith("cycles[dofs"))
    assert results["min_gap"]["value"] == 0 and results["min_pressure"]["value"] == 0
    assert results["max_coulomb_violation"]["value"] < 1e-12
    assert results["force_balance_error"]["value"] < 1e-6
    assert results["tangential_balance_error"]["value"] < 1e-6
    assert cost["residual"] <= 1e-8

    reader = pyvista.XdmfReader(out / "sphere.xdmf")
    mesh = reader.read()
    mesh = mesh[0] if isinstance(mesh, pyvista.MultiBlock) else mesh
    for name in ("contact_pressure", "contact_traction", "status", "gap", "displacement"):
        assert name in mesh.point_data
    assert mesh.point_data["contact_pressure"].max() > 1e4
