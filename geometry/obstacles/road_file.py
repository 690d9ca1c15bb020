"""Samples of a road from a text file, as profilometers write them."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

KINDS = {2: "a position and a height", 3: "two positions and a height"}


def read_samples(path: str | Path, clean: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Read the samples of a road: a position x, or positions x and y, and a height a line.

    Numbers are separated by commas, semicolons, tabs or blanks; the spacing may be irregular and the
    order any. Empty lines, lines that begin with #, and words in the first line are skipped. Scale them
    if need be, and give them to `LinearRoad` or `SmoothRoad.through`.

    Parameters
    ----------
    path : of the file
    clean : leave out samples without a height (NaN or nothing) and take the mean of those that share a
        position, and warn of
        it in one sentence, rather than refuse the file

    Returns
    -------
    positions : (m,) or (m, 2)
    heights : (m,)

    Raises
    ------
    ValueError
        one sentence with the number of the first line that is wrong.
    """
    rows, lines = _numbers(Path(path))
    if not rows:
        raise ValueError(f"{path} has no samples; a road needs {KINDS[2]}, or {KINDS[3]}, a line.")
    samples, line = np.array(rows), np.array(lines)
    infinite = np.isinf(samples).any(axis=1) | np.isnan(samples[:, :-1]).any(axis=1)
    if infinite.any():
        raise ValueError(f"{path}, line {line[np.argmax(infinite)]}: the numbers must be finite.")
    samples, line = _with_heights(path, samples, line, clean)
    samples = _at_one_place_each(path, samples, line, clean)
    positions = samples[:, 0] if samples.shape[1] == 2 else samples[:, :-1]
    return positions, samples[:, -1]


def _numbers(path: Path) -> tuple[list[list[float]], list[int]]:
    """Return the numbers of each sample and the line that it is on."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise ValueError(f"{path} is not a text file; give samples of the road as text.") from None
    rows: list[list[float]] = []
    lines: list[int] = []
    first = True
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        separator = next((s for s in ";,\t" if s in line), None)
        words = [word.strip() for word in line.strip().split(separator)]
        try:
            row = [float(word) if word else np.nan for word in words]
        except ValueError:
            if first:
                first = False
                continue
            wrong = next(word for word in words if not _is_number(word))
            raise ValueError(
                f"{path}, line {number}: {wrong!r} is not a number; write decimals with a point."
            ) from None
        first = False
        expected = [len(rows[0])] if rows else list(KINDS)
        if len(row) not in expected:
            wanted = " or ".join(f"{count} ({KINDS[count]})" for count in expected)
            raise ValueError(f"{path}, line {number}: there are {len(row)} numbers, but {wanted} are needed.")
        rows.append(row)
        lines.append(number)
    return rows, lines


def _is_number(word: str) -> bool:
    try:
        return not word or bool(float(word)) or True
    except ValueError:
        return False


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
