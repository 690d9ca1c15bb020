"""Samples of a road from an instrument's file, read by SurfaceTopography, or from OpenCRG, by pyopencrg."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from checks import is_path, refused
from geometry.obstacles.lengths import named_unit


def read_topography(
    path: str | Path, unit: str | None = None, clean: bool = False, **options: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Read the samples of a road from a file of an instrument, or of OpenCRG (.crg).

    SurfaceTopography knows over thirty formats of instruments. To detrend, filter or choose a channel, use it
    and hand its topography to `samples_of`.

    Parameters
    ----------
    path : of the file
    unit : of length, "mm" say, in which to return all; default the file's, metres for OpenCRG
    clean : leave out undefined samples, rather than refuse them
    **options : of `SurfaceTopography.read_topography`, or of `pyopencrg.read`

    Returns
    -------
    positions : (m,) of a line scan, else (m, 2)
    heights : (m,)

    Raises
    ------
    ImportError
        if the library that reads such files is not installed; the sentence says which.
    ValueError
        one sentence, if the file cannot be read.

    Examples
    --------
    >>> positions, heights = read_topography("scan.sur", unit="mm", clean=True)  # doctest: +SKIP
    >>> road = SmoothRoad.through(positions, heights)  # doctest: +SKIP
    """
    path = is_path(path)
    if not path.is_file():
        raise ValueError(f"There is no file {str(path)!r} to read a road from.")
    if path.suffix.lower() == ".crg":
        read = _import("pyopencrg").read
    else:
        read = _import("SurfaceTopography").read_topography
    try:
        found = read(str(path), **options)
    except Exception as error:
        reason = " ".join(str(error).split())[:200]
        raise ValueError(
            f"{read.__module__.partition('.')[0]} cannot read "
            f"{str(path)!r} ({type(error).__name__}: {reason})."
        ) from error
    if path.suffix.lower() == ".crg":
        return _samples(*found.grid_xy(), heights=found.surface_z(), size=1.0, unit=unit, clean=clean)
    return samples_of(found, unit, clean)


def samples_of(
    topography: Any, unit: str | None = None, clean: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return the samples of a topography of SurfaceTopography, detrended and filtered as the user likes.

    >>> topography = SurfaceTopography.read_topography("scan.sur")  # doctest: +SKIP
    >>> road = SmoothRoad.through(*samples_of(topography.detrend("height"), unit="mm"))  # doctest: +SKIP

    Parameters
    ----------
    topography : SurfaceTopography.Topography, UniformLineScan or NonuniformLineScan
    unit, clean : as of `read_topography`

    Returns
    -------
    positions : (m,) of a line scan, else (m, 2)
    heights : (m,)

    Raises
    ------
    ValueError
        for undefined samples, and for a unit that the topography does not have.
    """
    if not hasattr(topography, "positions"):
        raise refused("topography", "one of SurfaceTopography", topography)
    positions = topography.positions()
    positions = positions if topography.dim == 2 else (positions,)
    size = None if topography.unit is None else named_unit(topography.unit)
    heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=float), np.nan)
    return _samples(*positions, heights=heights, size=size, unit=unit, clean=clean)


def _samples(
    *positions: np.ndarray, heights: np.ndarray, size: float | None, unit: str | None, clean: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (m,) or (m, 2) and heights (m,), in that unit if one is given; size is that of theirs."""
    scale = 1.0
    if unit is not None:
        if size is None:
            raise ValueError(f"The topography has no unit, so that it cannot be had in {unit}; give it one.")
        scale = size / named_unit(unit)
    samples = np.column_stack([np.ravel(part) for part in (*positions, heights)]) * scale
    missing = ~np.isfinite(samples).all(axis=1)
    if missing.any() and not clean:
        raise ValueError(
            f"{missing.sum()} of {len(samples)} samples are undefined; fill them in, or leave them out with "
            "clean=True."
        )
    if missing.any():
        warnings.warn(f"{missing.sum()} of {len(samples)} undefined samples were left out.", stacklevel=3)
        samples = samples[~missing]
    return (samples[:, 0] if len(positions) == 1 else samples[:, :-1]), samples[:, -1]


def _import(name: str) -> Any:
    try:
        return __import__(name)
    except ImportError:
        raise ImportError(
            f"Such files are read by {name}, which is not installed; `pip install {name}` does it."
        ) from None
