"""Units of length by name, and where texts name them."""

from __future__ import annotations

import re

from checks import said

SIZES = {
    "km": 1e3, "m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "pm": 1e-12,
    "in": 0.0254, "inch": 0.0254, "inches": 0.0254, "ft": 0.3048, "feet": 0.3048, "mil": 2.54e-5,
    "mils": 2.54e-5, "micron": 1e-6, "microns": 1e-6,
}  # fmt: skip
PREFIXES = {"": 1.0, "kilo": 1e3, "centi": 1e-2, "milli": 1e-3, "micro": 1e-6, "nano": 1e-9}
SIZES |= {
    prefix + word: size
    for prefix, size in PREFIXES.items()
    for word in ("meter", "metre", "meters", "metres")
}
COLUMN = r"(?:[\[({<]|(?<=\S)(?:\s*[/,:]\s*|_|\s+(?:in\s+)?))\s*([^\W\d_]+)\s*[\])}>]?\s*$"
FOR_ALL = r"\W*(?:length\s+)?units?(?:\s+of\s+length)?\s*[:=;,\s]\s*\W?([^\W\d_]+)\W*"


def unit_size(name: str) -> float | None:
    """Metres of a unit of length, or None if it is none."""
    name = name.strip().replace("\N{MICRO SIGN}", "u").replace("\N{GREEK SMALL LETTER MU}", "u")
    return SIZES.get(name) or SIZES.get(name.lower() if len(name) > 2 else name)


def named_unit(name: str) -> float:
    """Metres of a unit of length, or the ValueError that says that it is none."""
    size = unit_size(name) if isinstance(name, str) else None
    if size is None:
        raise ValueError(f"{said(name)} is no unit of length; give km, m, cm, mm, um, nm, in or ft.")
    return size


def unit_of_column(name: str) -> float | None:
    """Metres of the unit at the end of a column's name: x [mm], x (mm), x / mm, x_mm, x in mm, x mm."""
    match = re.search(COLUMN, name)
    return unit_size(match[1]) if match else None


def unit_of_line(line: str, count: int) -> list[float | None]:
    """Metres of the units that a line names: one a column, or one for all after the word unit."""
    match = re.fullmatch(FOR_ALL, line, re.IGNORECASE)
    if match:
        size = unit_size(match[1])
        return [] if size is None else [size] * count
    bracketed = [unit_size(word) for word in re.findall(r"[\[(]\s*([^\W\d_]+)\s*[\])]", line)]
    alone = [unit_size(word) for word in re.split(r"[;,\t ]+", line.strip(" ;,\t"))]
    for sizes in (bracketed, alone):
        if len(sizes) == count and None not in sizes:
            return sizes
    return []
