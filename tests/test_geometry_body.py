"""From plain arrays to a dolfinx mesh and back; what is refused at the door; gmsh files."""

import numpy as np
import pytest

from forms import Elasticity, Isotropic
from geometry import Body, Grid, box, half_cylinder_nested, read_msh, rectangle, ring

import ufl  # isort: skip
from dolfinx import fem  # isort: skip


def changed(grid, **parts):
    return Grid(
        **{
            name: parts.get(name, getattr(grid, name))
            for name in ("points", "cells", "cell", "facets", "regions")
        }
    )


def test_names_and_regions_survive_the_renumbering():
    grid = rectangle(2.0, 1.0, 6, 4, distortion=0.2, regions={"soft": lambda c: c[:, 0] < 1})
    body = Body.from_grid(grid)
    for name, facets in grid.facets.items():
        there = body.coordinates[body.nodes(name)]
        given = grid.points[np.unique(facets)]
        np.testing.assert_array_equal(there[np.lexsort(there.T)], given[np.lexsort(given.T)])
        assert len(body.facet_tags.find(body.names[name])) == len(facets)
    centres = body.coordinates[body.cells].mean(axis=1)
    np.testing.assert_array_equal(np.flatnonzero(centres[:, 0] < 1), body.regions["soft"])


def test_prolongations_carry_linear_functions():
    body = Body.from_grid(rectangle(1.0, 1.0, 2, 2), 3, triangles=True)
    assert [P.shape[1] for P in body.prolongations] == [289, 81, 25, 9]
    values = body.coordinates
    for P in body.prolongations:
        copies = np.flatnonzero(np.diff(P.indptr) == 1)
        coarse = np.empty((P.shape[1], 2))
        coarse[P.indices[P.indptr[copies]]] = values[copies]
        np.testing.assert_allclose(P @ coarse, values, atol=1e-15)
        values = coarse


def test_refined_body_is_the_refined_grids_body():
    nested = Body.from_grid(half_cylinder_nested(10.0), 2)
    plain = Body.from_grid(half_cylinder_nested(10.0, 2))
    np.testing.assert_array_equal(nested.coordinates, plain.coordinates)
    assert len(nested.prolongations) == 2 and plain.prolongations == []


def test_unknown_boundary_names_the_known_ones():
    body = Body.from_grid(ring(0.5, 0.2, 12, 2))
    with pytest.raises(ValueError, match="'rim'.*'outer', 'inner'"):
        body.nodes("rim")
    with pytest.raises(ValueError, match="none at all"):
        Body.from_grid(changed(rectangle(1, 1, 2, 2), facets={})).nodes("top")


def test_a_facet_belongs_to_every_boundary_that_names_it():
    good = rectangle(2.0, 1.0, 4, 2)
    body = Body.from_grid(changed(good, facets={**good.facets, "half": good.facets["top"][:2]}))
    elasticity = Elasticity(body, Isotropic(1.0, 0.3))
    length = {name: elasticity.traction(name, (1.0, 0.0))[:, 0].sum() for name in body.facets}
    assert length == pytest.approx({"bottom": 2, "right": 1, "top": 2, "left": 1, "half": 1})
    both = elasticity.traction(["top", "half", "left"], (1.0, 0.0))[:, 0].sum()
    assert both == pytest.approx(3)
    ds = ufl.Measure("ds", body.mesh, subdomain_data=body.facet_tags)
    for name, value in length.items():
        assert fem.assemble_scalar(fem.form(1.0 * ds(body.names[name]))) == pytest.approx(value)


@pytest.mark.parametrize("dim", [2, 3])
def test_boundaries_by_position(dim):
    grid = rectangle(2.0, 1.0, 4, 2) if dim == 2 else box(2.0, 1.0, 1.0, 4, 2, 2)
    body = Body.from_grid(grid, refinements=1)
    body.mark("foot", lambda x: (x[dim - 1] < 1e-9) & (x[0] <= 1)).mark("all", lambda x: x[0] > -1)
    area = Elasticity(body, Isotropic(1.0, 0.3)).traction("foot", np.ones(dim)).sum(axis=0)
    np.testing.assert_allclose(area, 1)
    assert body.coordinates[body.nodes("foot"), dim - 1].max() == 0
    with pytest.raises(ValueError, match="'foot' on this body already"):
        body.mark("foot", lambda x: x[0] > 1)
    with pytest.raises(ValueError, match="No facet .* widen"):
        body.mark("one point", lambda x: x[0] + x[1] + x[2] < 1e-9)
    with pytest.raises(ValueError, match="must return"):
        body.mark("heights", lambda x: x[1])
    with pytest.raises(ValueError, match="is no boundary 'heights'"):
        body.nodes(["foot", "heights"])


def test_bad_meshes_are_refused_in_one_sentence():
    good = rectangle(1.0, 1.0, 3, 3)
    nan = good.points.copy()
    nan[5, 0] = np.nan
    folded = good.points.copy()
    folded[5] = [0.9, 0.9]
    unused = np.vstack([good.points, [[2.0, 2.0]]])
    triangles = good.halved()
    inverted = triangles.points.copy()
    inverted[5] = [0.4, 1.5]
    inside = {**good.facets, "inside": np.array([[5, 6]])}
    cases = {
        "Node 5 .* nan": changed(good, points=nan),
        "folded or flat": changed(good, points=folded),
        "belong to no cell.*node 16": changed(good, points=unused),
        "overlap|folded": changed(triangles, points=inverted),
        "'inside'": changed(good, facets=inside),
        "no cells": changed(good, cells=good.cells[:0]),
        "outside 0 ... 15": changed(good, cells=good.cells + 1),
        "3 coordinates, not 2|with 2 coordinates, not 3": changed(good, points=np.zeros((16, 3))),
    }
    for words, grid in cases.items():
        with pytest.raises(ValueError, match=words) as refusal:
            Body.from_grid(grid)
        assert str(refusal.value).endswith(".") and "\n" not in str(refusal.value)


def test_cells_listed_the_other_way_round_are_fine():
    good = rectangle(1.0, 1.0, 3, 3)
    cells = good.cells.copy()
    cells[::2] = cells[::2][:, [1, 0, 3, 2]]
    assert len(Body.from_grid(changed(good, cells=cells)).cells) == 9


@pytest.fixture
def gmsh():
    module = pytest.importorskip("gmsh")
    module.initialize()
    module.option.setNumber("General.Terminal", 0)
    yield module
    module.finalize()


@pytest.mark.parametrize("version, binary", [(4.1, 0), (4.1, 1), (2.2, 0)])
def test_named_groups_of_a_gmsh_file(gmsh, tmp_path, version, binary):
    box_ = gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    ball = gmsh.model.occ.addSphere(0.5, 0.5, 0.5, 0.3)
    gmsh.model.occ.fragment([(3, box_)], [(3, ball)])
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [ball], name="inclusion")
    gmsh.model.addPhysicalGroup(3, [v for _, v in gmsh.model.getEntities(3) if v != ball], name="matrix")
    floor = [s for _, s in gmsh.model.getEntities(2) if gmsh.model.getBoundingBox(2, s)[5] < 1e-3]
    gmsh.model.addPhysicalGroup(2, floor, tag=17)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
    gmsh.model.mesh.generate(3)
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(str(tmp_path / "box.msh"))

    body = Body.from_grid(read_msh(tmp_path / "box.msh"))
    assert body.cell == "tetrahedron" and set(body.regions) == {"inclusion", "matrix"}
    assert sum(len(cells) for cells in body.regions.values()) == len(body.cells)
    np.testing.assert_allclose(body.coordinates[body.nodes("17"), 2], 0, atol=1e-12)


def test_bad_gmsh_files_are_refused_in_one_sentence(gmsh, tmp_path):
    disk = gmsh.model.occ.addDisk(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [disk], name="disk")
    gmsh.model.mesh.generate(2)
    path = tmp_path / "whole.msh"
    gmsh.write(str(path))
    whole = path.read_text()
    assert len(read_msh(path).cells) > 10
    gmsh.model.mesh.setOrder(2)
    gmsh.write(str(path))
    cases = {
        "damaged": whole[: len(whole) // 2],
        "starts with .MeshFormat": "solid not a mesh",
        "no cells": "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n",
        "of degree 1": path.read_text(),
    }
    for words, text in cases.items():
        path.write_text(text)
        with pytest.raises(ValueError, match=words) as refusal:
            read_msh(path)
        assert str(refusal.value).endswith(".") and "\n" not in str(refusal.value)
    for missing in (tmp_path, tmp_path / "none.msh"):
        with pytest.raises(ValueError, match="There is no file"):
            read_msh(missing)
