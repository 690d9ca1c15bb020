"""Samples of a road from a text file, as profilometers and their users write them."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from checks import is_path, refused
from geometry.obstacles.lengths import named_unit, unit_of_column, unit_of_line
from geometry.obstacles.number_table import WANTED, NumberTable, read_table


def read_samples(
    path: str | Path,
    clean: bool = False,
    columns: Sequence[int | str] | None = None,
    unit: str | None = None,
    units: Sequence[str] | str | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    r"""Read the samples of a road: a position x, or positions x and y, and a height a line.

    Numbers are separated by semicolons, tabs, commas or blanks, and have decimal points or commas; the text
    may be UTF-8, UTF-16 or Latin-1. Lines of words above and below the samples, empty lines, and lines that
    begin with #, %, //, ! or ' are skipped; names and units of the columns are taken from those above where
    they say so. The spacing may be irregular and the order any. Give the samples to `LinearRoad` or
    `SmoothRoad.through`.

    Parameters
    ----------
    path : of the file
    clean : leave out samples without a height (nothing, NaN, Bad, or -9999 and the like beyond all others),
        take the mean of those that share a position, and warn of it, rather than refuse the file
    columns : numbers (0 is the first) or names of the columns to take, the height last; needed where there
        are more than two, unless three are x, y and height: by their names, or because most samples share
        their x with others, and most their y
    unit : of length, "mm" say, in which to return all; default that of the positions where the file names
        units, otherwise numbers as they are
    units : of the file's columns, one for all or one each, where it does not name them

    Returns
    -------
    positions : (m,) or (m, 2)
    heights : (m,)

    Raises
    ------
    ValueError
        one sentence with the number of the first line that is wrong.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> from geometry import read_samples
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "profile.txt"
    ...     _ = path.write_text("Profile 7\nx [mm]; z [um]\n0,0; 1,5\n0,1; 2,5\nEnd\n")
    ...     read_samples(path, unit="m")
    (array([0.    , 0.0001]), array([1.5e-06, 2.5e-06]))
    """
    path = is_path(path)
    table = read_table(path)
    chosen = _columns(path, table, columns)
    scale = _scales(path, table, chosen, unit, units)
    samples, line = table.rows[:, chosen], table.lines
    infinite = np.isinf(samples).any(axis=1) | np.isnan(samples[:, :-1]).any(axis=1)
    if infinite.any():
        raise ValueError(f"{path}, line {line[np.argmax(infinite)]}: the numbers must be finite.")
    samples, line = _with_heights(path, samples, line, clean)
    samples = _at_one_place_each(path, samples * scale, line, clean)
    positions = samples[:, 0] if samples.shape[1] == 2 else samples[:, :-1]
    return positions, samples[:, -1]


def _columns(path: Path, table: NumberTable, columns: Sequence[int | str] | None) -> list[int]:
    """Which columns are meant; never a guess."""
    count = table.rows.shape[1]
    known = ", ".join(
        f"{k} ({name})" if name else str(k) for k, name in enumerate(table.names or [""] * count)
    )
    if columns is None:
        if count == 2 or (count == 3 and _is_surface(table)):
            return list(range(count))
        if count < 2:
            raise ValueError(f"{path} has one column of numbers only; a road needs {WANTED[2]}.")
        raise ValueError(
            f"{path} has {count} columns, and nothing says which are positions and which the heights; "
            f"choose 2 or 3 with columns=(...) from {known}."
        )
    if not isinstance(columns, list | tuple):
        raise refused("columns", "2 or 3 numbers or names of columns", columns)
    chosen = []
    for column in columns:
        if isinstance(column, str):
            same = [k for k, name in enumerate(table.names) if _same_name(name, column)]
            if len(same) != 1:
                raise ValueError(f"{path} has no column {column!r} alone; its columns are {known}.")
            chosen.append(same[0])
        elif isinstance(column, int | np.integer) and 0 <= column < count:
            chosen.append(int(column))
        else:
            raise ValueError(f"{path} has no column {column!r}; its columns are {known}.")
    if len(chosen) not in WANTED or len(set(chosen)) < len(chosen):
        raise ValueError(f"The columns are {tuple(columns)}; give 2 or 3 different ones, the height last.")
    return chosen


def _same_name(name: str, wanted: str) -> bool:
    bare = re.sub(r"[\[(].*", "", name).strip().lower()
    return wanted.strip().lower() in (name.lower(), bare)


def _is_surface(table: NumberTable) -> bool:
    first = [name.strip().lower()[:1] for name in table.names[:2]]
    if first == ["x", "y"] or first[:1] == ["x"]:
        return first == ["x", "y"]
    shared = []
    for places in table.rows.T[:2]:
        _, number, copies = np.unique(places, return_inverse=True, return_counts=True)
        shared.append(np.mean(copies[number] > 1) > 0.5)
    return all(shared)


def _scales(
    path: Path, table: NumberTable, chosen: list[int], unit: str | None, units: Sequence[str] | str | None
) -> np.ndarray:
    """Factors of the chosen columns that bring them to one unit."""
    count = table.rows.shape[1]
    if units is None:
        named = _units(table, count)
        given = [named[k] for k in chosen]
    else:
        if not isinstance(units, str | list | tuple):
            raise refused("units", "a unit of length, or one for each column", units)
        each = [units] * count if isinstance(units, str) else list(units)
        if len(each) not in (count, len(chosen)):
            raise ValueError(
                f"{len(each)} units are given for {count} columns; give one for all, or one each."
            )
        given = [named_unit(each[k]) for k in (chosen if len(each) == count else range(len(chosen)))]
    wanted = None if unit is None else named_unit(unit)
    sizes = [size for size in given if size is not None]
    if not sizes and wanted is None:
        return np.ones(len(chosen))
    if len(sizes) < len(given):
        raise ValueError(
            f"{path} names no unit of length for {'some' if sizes else 'any'} of its columns; give them with "
            "units=(...)."
        )
    return np.array(sizes) / (sizes[0] if wanted is None else wanted)


def _units(table: NumberTable, count: int) -> list[float | None]:
    """Sizes of the units that the lines above the samples name for each column, the last line first."""
    if table.names:
        found = [unit_of_column(name) for name in table.names]
        if any(found):
            return found
    for line in reversed(table.above):
        found = unit_of_line(line, count)
        if found:
            return found
    return [None] * count


def _with_heights(
    path: str | Path, samples: np.ndarray, line: np.ndarray, clean: bool
) -> tuple[np.ndarray, np.ndarray]:
    missing = np.isnan(samples[:, -1])
    if not missing.any():
        return samples, line
    first = line[np.argmax(missing)]
    if not clean:
        raise ValueError(
            f"{path}, line {first}: the height is missing; fill it in, or leave it out with clean=True."
        )
    warnings.warn(
        f"{path}: {missing.sum()} samples without a height were left out, the first on line {first}.",
        stacklevel=3,
    )
    return samples[~missing], line[~missing]


def _at_one_place_each(path: str | Path, samples: np.ndarray, line: np.ndarray, clean: bool) -> np.ndarray:
    places, first, number = np.unique(samples[:, :-1], axis=0, return_index=True, return_inverse=True)
    if len(places) == len(samples):
        return samples
    repeated = np.ones(len(samples), dtype=bool)
    repeated[first] = False
    again = int(np.argmax(repeated))
    number = number.ravel()
    if not clean:
        raise ValueError(
            f"{path}, line {line[again]}: the position is that of line {line[first[number[again]]]}; "
            "leave one out, or take the mean with clean=True."
        )
    warnings.warn(
        f"{path}: {repeated.sum()} samples repeat a position, the first on line {line[again]}; "
        "the mean of their heights was taken.",
        stacklevel=3,
    )
    heights = np.bincount(number, samples[:, -1]) / np.bincount(number)
    return np.column_stack([places, heights])
