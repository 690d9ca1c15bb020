"""Fields on a body as XDMF and HDF5, written by dolfinx, for ParaView, VTK and h5py.

dolfinx gives each function a grid of its own and declares XInclude under an address at which VTK's reader
crashes. Here all fields of a step share one grid that names its mesh outright, so no XInclude is left.

The one file of this package that knows dolfinx; it is imported only when something is written.
"""

import contextlib
import errno
import os
import re
import shutil
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from checks import finite, is_path, named, numbers, refused, whole
from model.atomic_file import check_writable, write_aside
from model.results.gathered import gathered_if_shared

with contextlib.suppress(ImportError):
    import dolfinx_solver  # noqa: F401  (the PyPI wheel: before dolfinx)
if "petsc4py.PETSc" not in sys.modules:  # before PETSc: otherwise the two load different HDF5 libraries
    import h5py  # isort: skip  # noqa: F401
import basix.ufl  # isort: skip
from dolfinx import fem, io  # isort: skip
from dolfinx import mesh as dolfinx_mesh  # isort: skip
from mpi4py import MPI  # isort: skip

Fields = Mapping[str, np.ndarray]
HEAD = '<?xml version="1.0"?>\n<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>\n<Xdmf Version="3.0">\n<Domain>\n'
SERIES = '<Grid Name="series" GridType="Collection" CollectionType="Temporal">\n'
TAIL = "</Domain>\n</Xdmf>\n"


class HasMesh(Protocol):
    """What output needs of a body: a dolfinx mesh of degree 1, on one process.

    Its `cells` (cells, k), if it has such, say how its nodes are numbered; else they are as the mesh's own.
    """

    @property
    def mesh(self) -> Any:
        """The dolfinx mesh."""


class FacetMesh:
    """A mesh of facets, segments in the plane or triangles in space, that can be written as a body is.

    Parameters
    ----------
    points : ndarray, shape (n, dim)
    facets : ndarray of int, shape (m, dim)

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> len(FacetMesh(square, np.array([[0, 1], [1, 2], [2, 3], [3, 0]])).mesh.geometry.x)
    4
    """

    def __init__(self, points: np.ndarray, facets: np.ndarray):
        dim = points.shape[1]
        used, facets = np.unique(facets, return_inverse=True)
        cell = {2: "interval", 3: "triangle"}[dim]
        element: Any = basix.ufl.element(
            "Lagrange", cell, 1, shape=(dim,), lagrange_variant=basix.LagrangeVariant.equispaced
        )
        self.mesh = dolfinx_mesh.create_mesh(
            MPI.COMM_SELF, cells=facets.reshape(-1, dim).astype(np.int64), x=points[used], e=element
        )
        self.order = used[self.mesh.geometry.input_global_indices]  # point of each node of the mesh


def on_body(count: int, nodes: np.ndarray, values: np.ndarray, elsewhere: float = 0.0) -> np.ndarray:
    """Spread values at some nodes over all.

    Parameters
    ----------
    count : int
        Number of nodes of the body, N.
    nodes : ndarray of int, shape (n,)
        Say the contact candidates.
    values : ndarray, shape (n,) or (n, dim)
        Their pressure, traction, gap or status.
    elsewhere : float
        Value at the other nodes, say -1 for a status.

    Returns
    -------
    ndarray, shape (N,) or (N, dim)

    Examples
    --------
    >>> on_body(4, np.array([1, 2]), np.array([5.0, 6.0]))
    array([0., 5., 6., 0.])
    """
    whole(1, count=count)
    finite(elsewhere=elsewhere)
    values = numbers("values", values)
    field = np.full((count, *values.shape[1:]), float(elsewhere))
    field[nodes] = values
    return field


def write_xdmf(path: str | Path, body: HasMesh, nodes: Fields, cells: Fields | None = None) -> None:
    """Write fields once, to NAME.xdmf and NAME.h5.

    Parameters
    ----------
    path : str or Path
        NAME.xdmf.
    body : Body
        Its node order is that of the node fields, its cell order that of the cell fields.
    nodes : dict of ndarray
        Fields at the nodes by name, each (N,), (N, dim) or (N, dim, dim).
    cells : dict of ndarray, optional
        Fields of the cells likewise.

    Raises
    ------
    ValueError
        If a field does not fit the body or is not finite, or the files cannot be written.

    Examples
    --------
    >>> from geometry import Body, rectangle
    >>> body = Body.from_grid(rectangle(2.0, 1.0, 4, 2))
    >>> write_xdmf("still.xdmf", body, {"displacement": 0.0 * body.coordinates})
    """
    path = _xdmf(path)
    data_path = path.with_suffix(".h5")
    writer = _Writer(body)
    functions = writer.functions(nodes, cells or {})
    with write_aside(path) as aside:
        with write_aside(data_path) as data:
            mesh, attributes = writer.write(data, functions, with_mesh=True)
        grid = _grid("mesh", 0.0, mesh + attributes, data_path.name)
        aside.write_text(HEAD + grid + TAIL, encoding="utf-8")


class Series:
    """Fields step by step, to NAME.xdmf and a folder of HDF5 files, one a step.

    After each `write` the series is whole: every file it names is complete, and stays so if the process is
    killed. An earlier series of that name is replaced once the first step of this one is whole.

    Parameters
    ----------
    path : str or Path
        NAME.xdmf.
    body : Body
        As for `write_xdmf`; where many ranks share it, a BodyOnRoad: rank 0 writes what all hand in.
    resume_at : float, optional
        Go on with the series that is there, after its steps at earlier times than this.

    Raises
    ------
    ValueError
        If the file cannot be written, or there is no series of this body to go on with.

    Examples
    --------
    >>> from geometry import Body, rectangle
    >>> body = Body.from_grid(rectangle(2.0, 1.0, 4, 2))
    >>> series = Series("moving.xdmf", body)
    >>> for time in (0.0, 0.1):
    ...     series.write(time, {"displacement": time * body.coordinates})
    >>> series.path.read_text().count("<Time")
    2
    """

    def __init__(self, path: str | Path, body: HasMesh, resume_at: float | None = None):
        if resume_at is not None:
            finite(resume_at=resume_at)
        self._steps: list[str] = []
        self._mesh = ""
        self._whole = gathered_if_shared(body)
        if self._whole is None:
            self._open(path, body, resume_at)
            return
        trouble = ""
        try:
            if self._whole.body is not None:
                self._open(path, self._whole.body, resume_at)
        except ValueError as error:
            trouble = str(error)
        trouble = self._whole.comm.bcast(trouble)
        if trouble:
            raise ValueError(trouble)

    def _open(self, path: str | Path, body: HasMesh, resume_at: float | None) -> None:
        """Begin a series, or go on with one."""
        self.path = _xdmf(path)
        self._writer = _Writer(body)
        text = self.path.read_text(encoding="utf-8", errors="replace") if self.path.exists() else ""
        used = next((folder for folder in self._folders() if f">{folder.name}/" in text), None)
        # a new series goes to the folder that the old one does not use: both are whole until the switch
        self._folder = next(folder for folder in self._folders() if folder != used)
        if resume_at is not None:
            if used is None:
                raise ValueError(f"{self.path} holds no series to go on with; leave out resume_at.")
            self._folder = used
            self._take_up(text, resume_at)

    def write(self, time: float, nodes: Fields, cells: Fields | None = None) -> None:
        """Add a step.

        Parameters
        ----------
        time : float
            Its time (s), or load level.
        nodes, cells : dict of ndarray
            As for `write_xdmf`.

        Raises
        ------
        ValueError
            If a field does not fit the body or is not finite, or the files cannot be written.
        """
        finite(time=time)
        if self._whole is not None:
            nodes, cells = self._whole.fields(nodes, cells or {})
            if self._whole.body is None:
                return
        functions = self._writer.functions(nodes, cells or {})
        if not functions:
            raise refused("nodes", "a dictionary of one field or more", nodes)
        if not self._mesh:
            self._begin()
        count = len(self._steps)
        path = self._folder / f"{count:06d}.h5"
        with write_aside(path) as data:
            _, attributes = self._writer.write(data, functions, with_mesh=False)
        data_name = f"{self._folder.name}/{path.name}"
        self._steps.append(_grid(f"step {count}", time, self._mesh + attributes, data_name))
        with write_aside(self.path) as aside:
            aside.write_text(HEAD + SERIES + "".join(self._steps) + "</Grid>\n" + TAIL, encoding="utf-8")
        if count == 0:
            for folder in self._folders():
                if folder != self._folder:
                    shutil.rmtree(folder, ignore_errors=True)

    def _folders(self) -> list[Path]:
        """Folders that the data may be in."""
        return [self.path.with_suffix(suffix) for suffix in (".steps", ".steps2")]

    def _begin(self) -> None:
        """Write the mesh."""
        shutil.rmtree(self._folder, ignore_errors=True)
        with write_aside(self._folder / "mesh.h5") as data:
            mesh, _ = self._writer.write(data, [], with_mesh=True)
        self._mesh = mesh.replace("@@", f"{self._folder.name}/mesh.h5")

    def _take_up(self, text: str, time: float) -> None:
        """Read the mesh and the earlier steps of a series."""
        grids: list[Any] = ElementTree.fromstring(text).findall("./Domain/Grid/Grid")
        self._mesh = "".join(_text(grids[0].find(tag)) for tag in ("Topology", "Geometry"))
        self._steps = [_text(grid) for grid in grids if float(grid.find("Time").get("Value")) < time]
        found = int(grids[0].find("Geometry/DataItem").get("Dimensions").split()[0])
        if found != self._writer.nodes:
            raise ValueError(f"{self.path} is of a body with {found} nodes, not {self._writer.nodes}.")


class _Writer:
    """Arrays to dolfinx functions, and those to HDF5."""

    def __init__(self, body: HasMesh):
        if not hasattr(body, "mesh"):
            raise refused("body", "a Body, or a BodyOnRoad", body)
        self._mesh = body.mesh
        geometry = self._mesh.geometry
        cells = geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap
        self._cells = np.asarray(getattr(body, "cells", cells))
        self.nodes = len(geometry.x)
        self._cache: dict[tuple, tuple[Any, np.ndarray]] = {}

    def functions(self, nodes: Fields, cells: Fields) -> list[Any]:
        """Check the fields and fill dolfinx functions with them."""
        nodes, cells = named("nodes", nodes), named("cells", cells)
        both = sorted(set(nodes) & set(cells))
        if both:
            raise ValueError(f"The field {both[0]!r} is given for nodes and for cells; name each field once.")
        return [self._function(name, values, self.nodes, "nodes") for name, values in nodes.items()] + [
            self._function(name, values, len(self._cells), "cells") for name, values in cells.items()
        ]

    def _function(self, name: str, values: np.ndarray, count: int, where: str) -> Any:
        """Fill the function of one field."""
        values = numbers(f"The field {name!r}", values)
        if not name.isidentifier():
            raise ValueError(f"The field name {name!r} must consist of letters, digits and underscores.")
        if values.shape[:1] != (count,) or values.ndim > 3:
            raise ValueError(f"The field {name!r} has shape {values.shape}; the body has {count} {where}.")
        if not np.isfinite(values).all():
            first = np.flatnonzero(~np.isfinite(values.reshape(count, -1)).all(axis=1))[0]
            raise ValueError(f"The field {name!r} is not finite at {where} {first}.")
        if values.shape[1:] == (2, 2):  # dolfinx pads tensors as if they were a list of numbers
            values = np.pad(values, ((0, 0), (0, 1), (0, 1)))
        key = (name, where, values.shape)
        if key not in self._cache:
            self._cache[key] = self._new_function(name, where, values.shape[1:])
        function, order = self._cache[key]
        function.x.array.reshape(count, -1)[order] = values.reshape(count, -1)
        return function

    def _new_function(self, name: str, where: str, shape: tuple[int, ...]) -> tuple[Any, np.ndarray]:
        """Make a function, and the number of the degree of freedom of each node or cell."""
        cell = self._mesh.topology.cell_type.name
        if where == "nodes":
            geometry = self._mesh.geometry
            map_of_cell = geometry.cmaps[0] if hasattr(geometry, "cmaps") else geometry.cmap
            variant = basix.LagrangeVariant(map_of_cell.variant)
            element = basix.ufl.element("Lagrange", cell, 1, shape=shape, lagrange_variant=variant)
        else:
            element = basix.ufl.element("DG", cell, 0, shape=shape)
        V = fem.functionspace(self._mesh, element)
        order = V.dofmap.list[:, 0]
        if where == "nodes":
            order = np.empty(self.nodes, dtype=np.int64)
            order[self._cells] = V.dofmap.list
        return fem.Function(V, name=name), order

    def write(self, data: Path, functions: list[Any], with_mesh: bool) -> tuple[str, str]:
        """Write an HDF5 file; return the XML of mesh and attributes, with @@ for the file's name."""
        size = sum(2 * function.x.array.nbytes for function in functions) + 100_000
        if shutil.disk_usage(data.parent).free < size + with_mesh * 10 * self._cells.nbytes:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))  # before HDF5 prints pages about it
        xdmf = data.with_name(data.name + ".xdmf")  # dolfinx puts the HDF5 file beside it
        try:
            with io.XDMFFile(MPI.COMM_SELF, xdmf, "w") as file:
                if with_mesh:
                    file.write_mesh(self._mesh)
                for function in functions:
                    file.write_function(function, 0.0, "/Xdmf/Domain")
            os.replace(xdmf.with_suffix(".h5"), data)
            root = ElementTree.parse(xdmf).getroot()
        except RuntimeError as error:
            raise OSError(str(error)) from error
        finally:
            xdmf.unlink(missing_ok=True)
            xdmf.with_suffix(".h5").unlink(missing_ok=True)
        for item in root.iter("DataItem"):
            item.text = "@@:" + str(item.text).split(":", 1)[1]
            if "NumberType" not in item.attrib:  # XDMF takes four bytes for granted
                item.attrib |= {"NumberType": "Float", "Precision": "8"}
        mesh = [element for tag in ("Topology", "Geometry") for element in root.iter(tag)]
        return "".join(map(_text, mesh)), "".join(map(_text, root.iter("Attribute")))


def _xdmf(path: str | Path) -> Path:
    """Return a path that ends in .xdmf and can be written."""
    path = is_path(path)
    if path.suffix != ".xdmf":
        raise ValueError(f"The name {path.name!r} must end in .xdmf.")
    check_writable(path)
    return path


def _grid(name: str, time: float, content: str, data: str) -> str:
    """Put together an XDMF grid; @@ stands for the HDF5 file."""
    head = f'<Grid Name="{name}" GridType="Uniform">\n<Time Value="{float(time)!r}" />\n'
    return head + content.replace("@@", data) + "</Grid>\n"


def _text(element: Any) -> str:
    """Return an XML element as a text of its own."""
    return re.sub(r">\s+<", "><", ElementTree.tostring(element, encoding="unicode")).strip() + "\n"
