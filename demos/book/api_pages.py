"""The reference: a page for every room of the house, from the docstrings."""

import ast
from pathlib import Path

HOUSE = Path(__file__).parents[2]
PACKAGES = ("geometry", "forms", "model")


def write_api(folder: Path) -> None:
    """Write index.md and a page for every room into a folder."""
    folder.mkdir(parents=True)
    text = ["# Reference", "", "The rooms of the house, and what is in them. What scenes need is importable"]
    text += ["from `geometry`, `forms` and `model` themselves.", ""]
    for package in PACKAGES:
        rooms = [HOUSE / package, *sorted(p.parent for p in (HOUSE / package).glob("*/__init__.py"))]
        text += [f"## `{package}`", "", _docstring(HOUSE / package / "__init__.py"), ""]
        toctree = []
        for room in rooms:
            modules = [m for m in sorted(room.glob("*.py")) if m.name != "__init__.py" and _public(m)]
            if modules:
                name = _name(room)
                (folder / f"{name}.md").write_text(_room(room, modules), encoding="utf-8")
                toctree.append(name)
                text += [f"- {{doc}}`{name}`: {_docstring(room / '__init__.py').split(': ', 1)[-1]}"]
        text += ["", "```{toctree}", ":hidden:", "", *toctree, "```", ""]
    (folder / "index.md").write_text("\n".join(text), encoding="utf-8")


def _room(room: Path, modules: list[Path]) -> str:
    """Lay out the page of a room."""
    name = _name(room)
    text = [f"# {name}", "", _docstring(room / "__init__.py"), ""]
    for module in modules:
        dotted = _name(module.with_suffix(""))
        members = ", ".join(_public(module))
        text += [
            f"## {module.stem}",
            "",
            "```{eval-rst}",
            f".. automodule:: {dotted}",
            f"   :members: {members}",
        ]
        text += ["```", ""]
    return "\n".join(text)


def _public(module: Path) -> list[str]:
    """Names of the functions and classes with docstrings that a module has for others."""
    tree = ast.parse(module.read_text(encoding="utf-8"))
    kinds = (ast.FunctionDef, ast.ClassDef)
    return [
        node.name
        for node in tree.body
        if isinstance(node, kinds) and not node.name.startswith("_") and ast.get_docstring(node)
    ]


def _docstring(file: Path) -> str:
    return ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""


def _name(path: Path) -> str:
    return ".".join(path.relative_to(HOUSE).parts)
