"""Meshes from files of every kind, with the names that the files give."""

import numpy as np
import pytest

from forms import Elasticity, Isotropic, Support
from geometry import Body, box, read_mesh, rectangle

meshio = pytest.importorskip("meshio")


@pytest.fixture(scope="module")
def gmsh():
    module = pytest.importorskip("gmsh")
    module.initialize()
    module.option.setNumber("General.Terminal", 0)
    yield module
    module.finalize()


@pytest.fixture(scope="module")
def two_squares(gmsh):
    """Squares "soft" and "hard" side by side, together "all", on "foot", half of which is "left foot" too."""
    gmsh.model.add("two squares")
    occ = gmsh.model.occ
    occ.fragment([(2, occ.addRectangle(0, 0, 0, 1, 1))], [(2, occ.addRectangle(1, 0, 0, 1, 1))])
    occ.synchronize()
    for name, of in {"soft": [1], "hard": [2], "all": [1, 2]}.items():
        gmsh.model.addPhysicalGroup(2, of, name=name)
    curves = [(tag, gmsh.model.getBoundingBox(1, tag)) for _, tag in gmsh.model.getEntities(1)]
    foot = [tag for tag, (x0, y0, _, x1, y1, _) in curves if y1 < 0.1]
    gmsh.model.addPhysicalGroup(1, foot, name="foot")
    gmsh.model.addPhysicalGroup(
        1, [t for t in foot if gmsh.model.getBoundingBox(1, t)[3] < 1.1], name="left foot"
    )
    gmsh.model.addPhysicalGroup(1, [tag for tag, box in curves if box[0] > 0.9 and box[3] < 1.1], name="seam")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.25)
    gmsh.model.mesh.generate(2)
    return gmsh


def check_two_squares(grid):
    body = Body.from_grid(grid)
    elasticity = Elasticity(body, {"soft": Isotropic(1.0, 0.3), "hard": Isotropic(2.0, 0.3)})
    pull = {name: elasticity.traction(name, (1.0, 0.0)).sum() for name in ("foot", "left foot")}
    assert pull == pytest.approx({"foot": 2, "left foot": 1})
    assert len(body.regions["all"]) == len(body.cells)
    np.testing.assert_allclose(body.coordinates[body.nodes("seam"), 0], 1)
    return body


@pytest.mark.parametrize("version, binary", [(2.2, 0), (2.2, 1), (4.0, 0), (4.1, 0), (4.1, 1)])
def test_gmsh_files_of_all_versions(two_squares, tmp_path, version, binary):
    two_squares.option.setNumber("Mesh.MshFileVersion", version)
    two_squares.option.setNumber("Mesh.Binary", binary)
    two_squares.write(str(tmp_path / "two.msh"))
    check_two_squares(read_mesh(tmp_path / "two.msh"))


@pytest.mark.parametrize("suffix", [".med", ".unv", ".cgns"])
def test_other_files_that_gmsh_merges(two_squares, tmp_path, suffix):
    path = tmp_path / f"two{suffix}"
    two_squares.option.setNumber("Mesh.Binary", 0)
    two_squares.write(str(path))
    grid = read_mesh(path)
    check_two_squares(renamed(grid) if suffix == ".unv" else grid)


def renamed(grid):
    """The file format writes names without blanks."""
    for names in (grid.facets, grid.regions, grid.node_sets):
        for name in list(names):
            names[name.replace("_", " ")] = names.pop(name)
    return grid


def test_a_binary_file_of_version_4_0(two_squares, tmp_path):
    two_squares.option.setNumber("Mesh.MshFileVersion", 2.2)
    two_squares.option.setNumber("Mesh.Binary", 0)
    two_squares.write(str(tmp_path / "two.msh"))
    meshio.gmsh.write(tmp_path / "old.msh", meshio.read(tmp_path / "two.msh"), "4.0", True)
    check_two_squares(read_mesh(tmp_path / "old.msh"))


def as_meshio(grid, **sets):
    """The grid for meshio, its cells and facets in going-around order."""
    round_cell = {"quadrilateral": [0, 1, 3, 2], "hexahedron": [0, 1, 3, 2, 4, 5, 7, 6]}[grid.cell]
    cell, facet = {"quadrilateral": ("quad", "line"), "hexahedron": ("hexahedron", "quad")}[grid.cell]
    rows = np.concatenate([grid.facets["bottom"], grid.facets["top"]])
    rows = rows[:, [0, 1, 3, 2]] if facet == "quad" else rows
    tags = np.repeat([3, 4], [len(grid.facets["bottom"]), len(grid.facets["top"])])
    cells = [(cell, grid.cells[:, round_cell]), (facet, rows)]
    return meshio.Mesh(grid.points, cells, cell_data={"side": [np.zeros(len(grid.cells), int), tags]}, **sets)


@pytest.mark.parametrize("suffix", [".vtk", ".vtu", ".mesh", ".xdmf"])
@pytest.mark.parametrize("grid", [rectangle(2.0, 1.0, 4, 3), box(2.0, 1.0, 1.0, 4, 3, 2)], ids=["2d", "3d"])
def test_arrays_of_numbers_name_groups(tmp_path, suffix, grid):
    mesh = as_meshio(grid)
    if suffix == ".mesh":
        mesh.cell_data = {"medit:ref": mesh.cell_data["side"]}
    mesh.write(tmp_path / f"body{suffix}")
    array = "medit:ref" if suffix == ".mesh" else "side"
    body = Body.from_grid(read_mesh(tmp_path / f"body{suffix}"))
    assert set(body.facets) == {f"{array} 3", f"{array} 4"} and len(body.regions[f"{array} 0"]) == len(
        body.cells
    )
    np.testing.assert_allclose(body.coordinates[body.nodes(f"{array} 4"), -1], 1)


ABAQUS = """*Heading
** a plate of two elements
*Node, NSET=Nall
 1, 0., 0.
 2, 1., 0.
 3, 2., 0.
 14, 0., 1.
 15, 1., 1.
 16, 2., 1.
 99, 5., 5.
*Element, type=CPE4R, elset=left
 7, 1, 2, 15, 14
*ELEMENT, TYPE=cps3, ELSET=RIGHT
*Nset, nset=Foot, generate
 1, 3, 1
*Nset, nset=pin
 16,
*Nset, nset=reference
 99
*Elset, elset=every, generate
 7, 8, 1
*Elset, elset="both again"
 left, 8
*Elset, elset=_top_S3, internal
 7, 8
*Surface, type=ELEMENT, name=top
 _top_S3, S3
*Surface, name=ends
 7, S4
 8, S2
*Step
*Static
*End Step
""".replace("*ELEMENT, TYPE=cps3, ELSET=RIGHT\n", "*ELEMENT, TYPE=cps4,\n ELSET=RIGHT\n 8, 2,\n 3, 16, 15\n")


def test_abaqus_sets_and_surfaces(tmp_path):
    path = tmp_path / "plate.inp"
    path.write_text(ABAQUS)
    body = Body.from_grid(read_mesh(path))
    assert {name: len(cells) for name, cells in body.regions.items()} == {
        "left": 1, "RIGHT": 1, "every": 2, "both again": 2, "_top_S3": 2
    }  # fmt: skip
    assert {name: len(rows) for name, rows in body.facets.items()} == {
        "top": 2,
        "ends": 2,
        "Foot": 2,
        "Nall": 6,
    }
    np.testing.assert_allclose(body.coordinates[body.nodes("top"), 1], 1)
    np.testing.assert_allclose(body.coordinates[body.nodes("pin")], [[2, 1]])
    assert "reference" not in body.node_sets
    support = Support(body).fix("Foot", y=0.0).fix("pin", x=0.0)
    assert np.isnan(support.value).sum() == 12 - 4
    with pytest.raises(ValueError, match="'pin' is a set of nodes"):
        Elasticity(body, Isotropic(1, 0.3)).traction("pin", (1, 0))


@pytest.mark.parametrize("kind", ["C3D8", "C3D4"])
def test_faces_of_abaqus_solids_are_those_of_its_manual(tmp_path, kind):
    """One cell, each face by its number: all together are the surface, each the side that the manual says."""
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
    corners = corners if kind == "C3D8" else [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    sides = {"C3D8": "z-,z+,y-,x+,y+,x-", "C3D4": "z-,y-,,x-"}[kind].split(",")
    text = "*NODE\n" + "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(corners, start=1))
    text += f"*ELEMENT, TYPE={kind}\n1, " + ", ".join(map(str, range(1, len(corners) + 1))) + "\n"
    text += "".join(f"*SURFACE, NAME=face{k}\n1, S{k}\n" for k in range(1, len(sides) + 1))
    (tmp_path / "cell.inp").write_text(text)
    body = Body.from_grid(read_mesh(tmp_path / "cell.inp"))
    assert len(body.facet_indices(list(body.facets))) == len(sides)
    for k, side in enumerate(sides, start=1):
        if side:
            values = body.coordinates[body.nodes(f"face{k}"), "xyz".index(side[0])]
            np.testing.assert_array_equal(values, 0 if side[1] == "-" else 1)


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("cps4", "S8R", "elements of type S8R"),
        ("8, S2", "8, S9", "face 'S9' of a quadrilateral"),
        (" left, 8", " lefty, 8", "line 26: there is no set 'lefty'"),
        (" left, 8", " left, 18", "line 26: there is no element 18"),
        (" 16,\n", " 17,\n", "line 20: there is no node 17"),
        (" 8, S2", " 80, S2", "line 33: there is no element 80"),
        (" _top_S3, S3", " top_S3, S3", "line 30: there is no set 'top_S3'"),
        (" 3, 16, 15", " 3, 17, 15", "element 8 has node 17, which is nowhere"),
        (" 3, 16, 15", " 3, 16", "needs a label and 4 nodes"),
        (" 16, 2., 1.", " 16, 2., one", "line 9: 'one' is not a number"),
        (" 99, 5., 5.", " 16, 5., 5.", "node 16 is there twice"),
        ("*Step", "*Instance, name=a, part=b\n 1., 0., 0.\n*Step", "assembly"),
    ],
)
def test_abaqus_files_that_cannot_be_read(tmp_path, old, new, words):
    path = tmp_path / "plate.inp"
    path.write_text(ABAQUS.replace(old, new))
    with pytest.raises(ValueError, match=words):
        read_mesh(path)


def test_cells_need_a_group_too(gmsh, tmp_path):
    for dim in (2, 3):
        gmsh.model.add("no group of cells")
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1) if dim == 3 else gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(dim - 1, [1], name="side")
        gmsh.model.mesh.generate(dim)
        gmsh.write(str(tmp_path / "sides.msh"))
        gmsh.model.remove()
        with pytest.raises(ValueError, match="no cells; .*put the cells in a physical group too"):
            read_mesh(tmp_path / "sides.msh")


@pytest.mark.parametrize(
    "name, text, words",
    [
        ("part.stl", "solid a\nendsolid a\n", "surface of a body only.*SurfaceRoad.read"),
        ("part.step", "ISO-10303-21;", "holds a shape"),
        ("part.vtu", "<VTKFile", "meshio cannot read"),
        ("part.unv", "    -1\n  2411\n", "no cells|cannot read"),
        ("part.abc", "?", "meshio cannot read"),
    ],
)
def test_files_that_hold_no_body(tmp_path, name, text, words):
    if name.endswith(".unv"):
        pytest.importorskip("gmsh")
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=words) as refusal:
        read_mesh(tmp_path / name)
    assert str(refusal.value).endswith(".") and "\n" not in str(refusal.value)
