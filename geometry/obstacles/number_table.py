"""Columns of numbers in a text file, whatever its encoding, separator and decimal sign."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geometry.obstacles.lengths import unit_size

SEPARATORS = [";", "\t", ",", None]  # None: blanks
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([ed][+-]?\d+)?|[+-]?inf(inity)?", re.IGNORECASE)
LIKE_A_NUMBER = re.compile(r"[+-]?[\dOl.,;]*\d[\dOl.,;]*[A-Za-z]?[\d.,;]*|[Ool][.,]\d+")  # mistyped
MISSING = {"", "bad", "nan", "n/a", "na", "#n/a", "#nv", "null", "none", "missing", "invalid"}
MISSING |= {"-", "--", "---", "*"}
SENTINELS = [-9999.0, -99999.0, -999999.0, -32768.0, 1e30, 1e38, 3.4e38]  # written for nothing measured
COMMENT = re.compile(r"#|%|//|!|'")
WANTED = {2: "a position and a height", 3: "two positions and a height"}


@dataclass
class NumberTable:
    """What `read_table` found.

    Attributes
    ----------
    rows : (m, columns) numbers, NaN where there is none
    lines : (m,) line of the file that each row is on, the first being 1
    names : of the columns, with their units, or none
    above : the lines above the numbers
    """

    rows: np.ndarray
    lines: np.ndarray
    names: list[str]
    above: list[str]


def _text(path: Path) -> str:
    """Decode a text file, or say that it is none (ValueError)."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}.") from None
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encodings = ["utf-16"]
    elif len(data) > 1 and data[1::2].count(0) > len(data) // 4:
        encodings = ["utf-16-le"]
    elif data[0::2].count(0) > len(data) // 4:
        encodings = ["utf-16-be"]
    else:
        encodings = ["utf-8-sig", "latin-1"]
    for encoding in encodings:
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not re.search(r"[\x00-\x08\x0e-\x1f]", text):
            return text
    raise ValueError(f"{path} is not a text file; give samples of the road as text.")


def read_table(path: Path) -> NumberTable:
    """Read by the separator and the decimal sign that make rows of numbers of the most lines.

    Raises
    ------
    ValueError
        one sentence with the first line that is neither a row, nor words above or below the rows.
    """
    lines = [(n, line) for n, line in enumerate(_text(path).splitlines(), start=1) if line.strip()]
    spoken = [(number, line.strip("\f\v ")) for number, line in lines if not COMMENT.match(line.lstrip())]
    readings = {
        (separator, decimal): [_row(line, separator, decimal) for _, line in spoken]
        for separator in SEPARATORS
        for decimal in ".,"
        if separator != decimal
    }
    (separator, decimal), rows = max(readings.items(), key=lambda r: sum(row is not None for row in r[1]))
    found = [k for k, row in enumerate(rows) if row is not None]
    width = len(rows[found[0]] or ()) if found else 0
    for k, (number, line) in enumerate(spoken):
        words = _words(line, separator)
        beyond = bool(found) and not found[0] <= k <= found[-1]
        if beyond and _is_text(words, decimal, width, len(found)):
            continue
        if rows[k] is None and (len(words) > 1 or _number(words[0], decimal) is None):
            raise ValueError(
                f"{path}, line {number}: {_culprit(line, decimal)!r} is not a number; write decimals with a "
                f"{'point' if decimal == '.' else 'comma'}, and # before lines that are no samples."
            )
        if len(words) != width:
            wanted = {width: WANTED[width]} if width in WANTED else WANTED
            needed = " or ".join(f"{count} ({what})" for count, what in wanted.items())
            raise ValueError(
                f"{path}, line {number}: there are {len(words)} numbers, but {needed} are needed."
            )
    if not found:
        needed = ", or ".join(WANTED.values())
        raise ValueError(f"{path} has no samples; a road needs {needed}, a line.")
    values = np.array(rows[found[0] : found[-1] + 1])
    numbers = np.array([number for number, _ in spoken[found[0] : found[-1] + 1]])
    kept = np.flatnonzero(~np.isnan(values).all(axis=0))  # separators at the ends of lines make empty columns
    above = [COMMENT.sub("", line.strip(), count=1).strip() for n, line in lines if n < numbers[0]]
    names = _names(above, separator, width, kept)
    return NumberTable(_without_sentinels(values[:, kept]), numbers, names, above)


def _words(line: str, separator: str | None) -> list[str]:
    return [word.strip().strip('"') for word in line.split(separator)]


def _number(word: str, decimal: str) -> float | None:
    """The number that a word is, NaN where it says that there is none; None if it is neither."""
    if word.lower() in MISSING:
        return np.nan
    if decimal == ",":
        word = word.replace(".", "x").replace(",", ".")
    return float(word.lower().replace("d", "e")) if NUMBER.fullmatch(word) else None


def _row(line: str, separator: str | None, decimal: str) -> list[float] | None:
    """The numbers of a line, of which one may not be missing; None where it is no row of two or more."""
    numbers = [_number(word, decimal) for word in _words(line, separator)]
    values = [number for number in numbers if number is not None]
    if len(numbers) < 2 or len(values) < len(numbers) or np.isnan(values).all():
        return None
    return values


def _is_text(words: list[str], decimal: str, width: int, count: int) -> bool:
    """Whether a line above or below the rows does not begin as they do, so that it is none with a mistake.

    The number of rows (count), alone on a line, is text too.
    """
    if len(words) == 1:
        number = _number(words[0], decimal)
        return number is None or number == count
    return len(words) != width or not (
        _number(words[0], decimal) is not None or LIKE_A_NUMBER.fullmatch(words[0])
    )


def _culprit(line: str, decimal: str) -> str:
    """The first word of a line that is no number."""
    separator = next((s for s in ";\t," if s in line and s != decimal), None)
    words = _words(line, separator)
    return next((word for word in words if _number(word, decimal) is None), line)


def _names(above: list[str], separator: str | None, width: int, kept: np.ndarray) -> list[str]:
    """Names of the columns: of the last line above the rows with so many words that are not all units."""
    for line in reversed(above):
        words = _words(line, separator)
        words = [words[k] for k in kept] if len(words) == width else words
        units = [unit_size(word.strip("[]() ")) for word in words]
        if len(words) == len(kept) and None in units:
            return words
    return []


def _without_sentinels(values: np.ndarray) -> np.ndarray:
    """Take numbers that stand for nothing out of the last columns, where they are beyond all others."""
    values = values.copy()
    for column in values.T[1:]:
        marked = np.isin(column, SENTINELS)
        rest = column[~marked & np.isfinite(column)]
        if marked.any() and rest.size:
            beyond = (column < rest.min()) | (column > rest.max())
            column[marked & beyond] = np.nan
    return values
