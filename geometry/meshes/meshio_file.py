"""Files that meshio reads."""

from __future__ import annotations

import contextlib
import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from geometry.meshes.raw_mesh import RawMesh

KIND_OF_TYPE = {
    "vertex": "vertex", "line": "interval", "triangle": "triangle", "quad": "quadrilateral",
    "tetra": "tetrahedron", "hexahedron": "hexahedron",
}  # fmt: skip
# Arrays of numbers that are no groups of the user's
BOOKKEEPING = {
    "gmsh:geometrical",
    "vtkOriginalCellIds",
    "vtkOriginalPointIds",
    "vtkGhostType",
    "gmsh:dim_tags",
}


def read_by_meshio(path: Path) -> RawMesh:
    """Read what meshio reads: .vtk, .vtu, .xdmf and others.

    Groups are the sets that the file names, and whatever shares a value of an array of whole numbers: under
    the value's name where the file gives one, else under "ARRAY VALUE".

    Raises
    ------
    ValueError
        one sentence, if meshio cannot read the file.
    """
    try:
        import meshio
    except ImportError as error:
        raise ImportError(
            f"Files of type {path.suffix} need meshio, which is not installed; `pip install meshio` does it."
        ) from error
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio ends the process where it cannot read
        reason = " ".join((said.getvalue() if isinstance(error, SystemExit) else str(error)).split())
        raise ValueError(
            f"meshio cannot read {str(path)!r} ({reason or type(error).__name__}); the file may be damaged, "
            "or of a kind that meshio does not know."
        ) from error
    return meshio_mesh(mesh, repr(str(path)))


def meshio_mesh(mesh: Any, source: str) -> RawMesh:
    """Return a `meshio.Mesh`."""
    raw = RawMesh(source, np.asarray(mesh.points, dtype=float))
    columns = {name: [_column(values) for values in blocks] for name, blocks in mesh.cell_data.items()}
    arrays = [name for name, blocks in columns.items() if _groups(name, np.concatenate(blocks))]
    for block, cells in enumerate(mesh.cells):
        if cells.type not in KIND_OF_TYPE:
            raw.others.add(cells.type)
            continue
        kind = KIND_OF_TYPE[cells.type]
        start = len(raw.rows.get(kind, ()))
        raw.add(kind, cells.data)
        for name, members in mesh.cell_sets.items():
            if members[block] is not None and len(members[block]) and not name.startswith("gmsh:"):
                raw.put(name, kind, start + np.asarray(members[block], dtype=np.int64))
        for name in arrays:
            for value, numbers in _shared(columns[name][block]):
                raw.put(_named(mesh, name, value, cells.dim), kind, start + numbers)
    raw.point_sets = {name: np.asarray(points, dtype=np.int64) for name, points in mesh.point_sets.items()}
    return raw


def _column(values: np.ndarray) -> np.ndarray:
    """An array (n, 1) as (n,)."""
    values = np.asarray(values)
    return values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values


def _groups(name: str, values: np.ndarray) -> bool:
    """Whether an array tells groups: whole numbers that cells share, not numbers of the cells."""
    whole = np.issubdtype(values.dtype, np.integer) or name == "gmsh:physical"
    return name not in BOOKKEEPING and whole and values.ndim == 1 and len(np.unique(values)) < len(values)


def _shared(values: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Each value, and which cells have it."""
    distinct, number = np.unique(values, return_inverse=True)
    cells = np.split(np.argsort(number, kind="stable"), np.cumsum(np.bincount(number))[:-1])
    return list(zip(distinct.astype(int).tolist(), cells))


def _named(mesh: Any, array: str, value: int, dim: int) -> str:
    """The name that the file gives to a value of an array."""
    if array == "gmsh:physical":
        named = {tuple(tag): name for name, tag in mesh.field_data.items()}
        return str(named.get((value, dim), value))
    names = getattr(mesh, "cell_tags", {}).get(value, []) if array == "cell_tags" else []
    return names[0] if names else f"{array} {value}"
