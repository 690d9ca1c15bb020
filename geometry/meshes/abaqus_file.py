"""Abaqus's input files: nodes, elements, sets of both, and surfaces.

meshio reads nodes and elements of such files, but neither their surfaces nor all ways of writing sets.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from geometry.meshes.raw_mesh import DIMENSIONS, ORDER, RawMesh

# Families of elements, whose names go on with the number of nodes: C3D8R, CPE4I, S4
FAMILIES = {
    r"C3D|DC3D|AC3D": {4: "tetrahedron", 8: "hexahedron"},
    r"CPS|CPE|CPEG|CAX|DC2D|AC2D|S|M3D|SFM3D|R3D|DS|STRI": {3: "triangle", 4: "quadrilateral"},
    r"T2D|T3D|R2D|RAX": {2: "interval"},
}
# Nodes of the faces S1, S2, ... of an element (Abaqus Analysis User's Guide, continuum elements)
FACES = {
    "triangle": [[0, 1], [1, 2], [2, 0]],
    "quadrilateral": [[0, 1], [1, 2], [2, 3], [3, 0]],
    "tetrahedron": [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]],
    "hexahedron": [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]],
}
FACET_ORDER = {2: [0, 1], 3: [0, 1, 2], 4: ORDER["quadrilateral"]}


def read_abaqus(path: Path) -> RawMesh:
    """Read an .inp file of one part.

    Raises
    ------
    ValueError
        one sentence with the number of the line, for what cannot be read.
    """
    file = _Abaqus(path)
    for keyword, options, rows in _blocks(path):
        read = getattr(file, f"_{keyword.lower()}", None)
        if read is not None:
            read(options, rows)
    return file.mesh()


def _blocks(path: Path) -> Iterator[tuple[str, dict[str, str], list[tuple[str, list[str]]]]]:
    """Keyword, options and lines of data, each (where it is, words); included files in their place."""
    keyword = ""
    options: dict[str, str] = {}
    rows: list[tuple[str, list[str]]] = []
    for where, line in _lines(path):
        if not line.startswith("*"):
            rows.append((where, [word.strip() for word in line.rstrip(",").split(",")]))
            continue
        yield keyword, options, rows
        words = [word.strip() for word in line[1:].split(",")]
        pairs = (word.partition("=") for word in words[1:])
        keyword, rows = words[0].upper().replace(" ", ""), []
        options = {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}
        if keyword == "INCLUDE":
            yield from _blocks(path.parent / options.get("INPUT", ""))
            keyword = ""
    yield keyword, options, rows


def _lines(path: Path) -> Iterator[tuple[str, str]]:
    """The lines that say something, those that end in a comma under a keyword joined, with where they are."""
    try:
        text = path.read_text(encoding="latin-1")
    except OSError as error:
        raise ValueError(f"{str(path)!r} cannot be read: {error.strerror}.") from None
    begun = ""
    for number, line in enumerate(text.splitlines(), start=1):
        line = line.strip()
        if not line or line.startswith("**"):
            continue
        line = begun + line
        begun = line if line.startswith("*") and line.endswith(",") else ""
        if not begun:
            yield f"{str(path)!r}, line {number}", line


class _Abaqus:
    """What has been read so far; names are compared without their case, as Abaqus does."""

    def __init__(self, path: Path):
        self.raw = RawMesh(repr(str(path)), np.empty((0, 3)))
        self.points: list[list[float]] = []
        self.node: dict[int, int] = {}  # number of each node label
        self.element: dict[int, tuple[str, list[int]]] = {}  # kind and nodes of each element label
        self.sets: dict[str, dict[str, list[int]]] = {"NSET": {}, "ELSET": {}}  # labels
        self.spelling: dict[str, str] = {}
        self.surfaces: dict[str, list[list[int]]] = {}
        self.instances = 0
        self.skipped: set[int] = set()  # labels of elements of other types
        self.named: list[tuple[str, str, int]] = []  # where, kind and label of single members of sets

    def _called(self, name: str) -> str:
        return self.spelling.setdefault(name.upper(), name).upper()

    def _add(self, kind: str, name: str, labels: list[int]) -> None:
        self.sets[kind].setdefault(self._called(name), []).extend(labels)

    def _node(self, options: dict[str, str], rows: list[tuple[str, list[str]]]) -> None:
        labels = []
        for where, words in rows:
            label, *position = (_number(word, where) for word in words)
            if int(label) in self.node:
                raise ValueError(
                    f"{where}: node {int(label)} is there twice; only files of one part can be read."
                )
            self.node[int(label)] = len(self.points)
            self.points.append((position + [0.0, 0.0, 0.0])[:3])
            labels.append(int(label))
        if "NSET" in options:
            self._add("NSET", options["NSET"], labels)

    def _element(self, options: dict[str, str], rows: list[tuple[str, list[str]]]) -> None:
        type_ = options.get("TYPE", "").upper()
        kind = _kind(type_)
        if kind is None:
            self.raw.others.add(f"elements of type {type_}")
            self.skipped |= {int(words[0]) for _, words in rows if words[0].isdigit()}
            return
        width, words = len(ORDER[kind]) + 1, [(where, word) for where, line in rows for word in line]
        numbers = [int(_number(word, where)) for where, word in words]
        if len(numbers) % width:
            raise ValueError(
                f"{words[-1][0]}: an element of type {type_} needs a label and {width - 1} nodes."
            )
        labels = numbers[::width]
        for k, label in enumerate(labels):
            nodes = numbers[k * width + 1 : (k + 1) * width]
            missing = [node for node in nodes if node not in self.node]
            if missing:
                raise ValueError(
                    f"{words[k * width][0]}: element {label} has node {missing[0]}, which is nowhere."
                )
            self.element[label] = kind, [self.node[node] for node in nodes]
        if "ELSET" in options:
            self._add("ELSET", options["ELSET"], labels)

    def _nset(self, options: dict[str, str], rows: list[tuple[str, list[str]]]) -> None:
        self._set("NSET", options, rows)
        if "ELSET" in options:
            inside = self.sets["ELSET"].get(options["ELSET"].upper(), [])
            of_number = {number: label for label, number in self.node.items()}
            nodes = {number for label in inside for number in self.element[label][1]}
            self._add("NSET", options["NSET"], [of_number[number] for number in nodes])

    def _elset(self, options: dict[str, str], rows: list[tuple[str, list[str]]]) -> None:
        self._set("ELSET", options, rows)

    def _set(self, kind: str, options: dict[str, str], rows: list[tuple[str, list[str]]]) -> None:
        labels: list[int] = []
        for where, words in rows:
            if "GENERATE" in options:
                first, last, step = ([int(_number(word, where)) for word in words] + [1])[:3]
                labels += range(first, last + 1, step)
                continue
            for word in words:
                labels += [int(word)] if word.isdigit() else self._members(kind, word, where)
            self.named += [(where, kind, int(word)) for word in words if word.isdigit()]
        self._add(kind, options.get(kind, ""), labels)

    def _members(self, kind: str, name: str, where: str) -> list[int]:
        name = name.rpartition(".")[2]
        if name.upper() not in self.sets[kind]:
            raise ValueError(f"{where}: there is no set {name!r} before this line.")
        return self.sets[kind][name.upper()]

    def _require(self, kind: str, label: int, where: str) -> None:
        known = self.node.keys() if kind == "NSET" else self.element.keys() | self.skipped
        if label not in known:
            what = "node" if kind == "NSET" else "element"
            raise ValueError(f"{where}: there is no {what} {label} in this file.")

    def _surface(self, options: dict[str, str], rows: list[tuple[str, list[str]]]) -> None:
        name = options.get("NAME", "")
        for where, words in rows:
            chosen = words[0]
            if options.get("TYPE", "ELEMENT").upper() == "NODE":
                nodes = [int(chosen)] if chosen.isdigit() else self._members("NSET", chosen, where)
                self.named += [(where, "NSET", node) for node in nodes]
                self._add("NSET", name, nodes)
                continue
            labels = [int(chosen)] if chosen.isdigit() else self._members("ELSET", chosen, where)
            face = words[1].upper() if len(words) > 1 else ""
            for label in labels:
                if label in self.skipped:
                    continue
                self._require("ELSET", label, where)
                kind, corners = self.element[label]
                faces = FACES.get(kind, [])
                if not re.fullmatch("S[1-6]", face) or int(face[1]) > len(faces):
                    raise ValueError(
                        f"{where}: the surface {name!r} has the face {face!r} of a {kind}; name faces S1 to "
                        f"S{len(faces)} of elements of the body."
                    )
                self.surfaces.setdefault(name, []).append([corners[k] for k in faces[int(face[1]) - 1]])

    def _instance(self, options: dict[str, str], rows: list[tuple[str, list[str]]]) -> None:
        self.instances += 1
        if rows or self.instances > 1:
            raise ValueError(
                f"{self.raw.source} has an assembly of several parts, or of one that is moved; write "
                "the mesh as one part without an assembly (Abaqus: noPartsInputFile=ON)."
            )

    def mesh(self) -> RawMesh:
        """Return what has been read."""
        raw = self.raw
        for where, kind, label in self.named:
            self._require(kind, label, where)
        number: dict[int, tuple[str, int]] = {}
        raw.points = np.array(self.points).reshape(-1, 3)
        for kind in DIMENSIONS:
            labels = [label for label, (its, _) in self.element.items() if its == kind]
            if labels:
                number |= {label: (kind, k) for k, label in enumerate(labels)}
                raw.add(kind, np.array([self.element[label][1] for label in labels]))
        for name, labels in self.sets["ELSET"].items():
            members = [number[label] for label in labels if label in number]
            for kind in {kind for kind, _ in members}:
                raw.put(self.spelling[name], kind, np.array([k for its, k in members if its == kind]))
        for name, labels in self.sets["NSET"].items():
            nodes = [self.node[label] for label in labels if label in self.node]
            raw.point_sets[self.spelling[name]] = np.array(nodes, dtype=np.int64)
        for name, faces in self.surfaces.items():
            if len({len(face) for face in faces}) == 1:
                raw.faces[name] = np.array(faces)[:, FACET_ORDER[len(faces[0])]]
        return raw


def _kind(type_: str) -> str | None:
    for family, kinds in FAMILIES.items():
        match = re.fullmatch(f"(?:{family})(\\d+)([A-Z].*)?", type_)
        if match:
            return kinds.get(int(match[1]))
    return None


def _number(word: str, where: str) -> float:
    try:
        return float(word.upper().replace("D", "E"))
    except ValueError:
        raise ValueError(f"{where}: {word!r} is not a number.") from None
