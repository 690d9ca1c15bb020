"""Files that gmsh reads, and gmsh's own meshes."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from geometry.meshes.raw_mesh import ORDER, RawMesh

# gmsh's element types of degree 1
KIND_OF_TYPE = {
    15: "vertex",
    1: "interval",
    2: "triangle",
    3: "quadrilateral",
    4: "tetrahedron",
    5: "hexahedron",
}
CONVERT = """
import gmsh, sys
gmsh.initialize(["gmsh", "-v", "0"], False)
gmsh.merge(sys.argv[1])
gmsh.option.setNumber("Mesh.SaveAll", 1)
gmsh.write(sys.argv[2])
"""


def read_by_gmsh(path: Path) -> RawMesh:
    """Read what gmsh can merge: .msh of all versions, .med, .unv and others.

    Physical groups are groups under their names, or their tags where they have no name.

    Raises
    ------
    ValueError
        one sentence, if gmsh cannot read the file.
    """
    with tempfile.TemporaryDirectory() as folder, gmsh_session() as gmsh:
        own = path if path.suffix.lower() == ".msh" else _converted(path, Path(folder) / "converted.msh")
        try:
            gmsh.merge(str(own))
        except Exception as error:
            raise _unreadable(path, str(error)) from error
        return gmsh_mesh(gmsh, repr(str(path)))


def _converted(path: Path, to: Path) -> Path:
    """Let a gmsh in a process of its own turn a file into its own format.

    In this process it would end us where it crashes, as gmsh 4.15 does on groups of a .unv that name an
    element which is not there, and mix the contents of a .med with a model of the same name.
    """
    run = subprocess.run([sys.executable, "-c", CONVERT, path, to], capture_output=True, text=True)
    if run.returncode:
        said = run.stderr.strip().rpartition("\n")[2].removeprefix("Exception: ")
        raise _unreadable(path, "it crashes" if run.returncode < 0 else said)
    return to


def _unreadable(path: Path, reason: str) -> ValueError:
    reason = reason or "it does not say why"
    return ValueError(f"gmsh cannot read {str(path)!r} ({reason}); the file may be damaged.")


@contextmanager
def gmsh_session() -> Iterator:
    """Run gmsh silently in a model of its own, leaving a gmsh that the caller may be running as it was."""
    try:
        import gmsh
    except ImportError as error:
        raise ImportError(
            "This needs gmsh, which is not installed; install it with `pip install gmsh`."
        ) from error
    except OSError as error:
        raise ImportError(
            f"gmsh cannot be loaded ({error}); install its system libraries, on Debian and Ubuntu "
            "`apt install libglu1-mesa libxft2 libxinerama1 libxcursor1`."
        ) from error
    started = not gmsh.isInitialized()
    if started:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("zerogap")
    try:
        yield gmsh
    finally:
        gmsh.model.remove()
        if started:
            gmsh.finalize()


def gmsh_mesh(gmsh: Any, source: str) -> RawMesh:
    """Return gmsh's current mesh."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    mesh = RawMesh(source, coordinates.reshape(-1, 3)[order], grouped_only=True)
    names: dict[tuple[int, int], list[str]] = {}
    for dim, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(dim, tag).strip() or str(tag)
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            names.setdefault((dim, int(entity)), []).append(name)
    for entity in gmsh.model.getEntities():
        for type_, _, vertices in zip(*gmsh.model.mesh.getElements(*entity)):
            if type_ not in KIND_OF_TYPE:
                mesh.others.add(gmsh.model.mesh.getElementProperties(type_)[0])
                continue
            kind = KIND_OF_TYPE[type_]
            rows = np.searchsorted(tags, vertices, sorter=order).reshape(-1, len(ORDER[kind]))
            mesh.add(kind, rows, names.get(entity, []))
    return mesh
