"""Random rough roads, written as a profilometer would."""

from pathlib import Path

import numpy as np

from geometry import SmoothRoad
from harness.scene import Scene
from model import write_xdmf
from model.atomic_file import write_aside


def rough_heights(
    positions: np.ndarray,
    roughness: float,
    wavelengths: tuple[float, float],
    power: float,
    waves: int = 24,
    seed: int = 3,
) -> np.ndarray:
    """Heights (m,) of a road of random waves, whose amplitudes grow with the wavelength as measured roads' do.

    Parameters
    ----------
    positions : (m,), or (m, 2) for a surface
    roughness : float
        Standard deviation of the heights.
    wavelengths : (shortest, longest)
    power : float
        An amplitude is the wavelength to this power; 1/2 is ISO 8608's spectrum, falling with the square of the
        wavenumber, where each wave stands for a band as wide as its wavenumber.
    waves : int
    seed : int
        Of the phases, and on a surface of the directions.

    Examples
    --------
    >>> heights = rough_heights(np.linspace(0, 10, 500), 0.2, (0.5, 2.0), 0.5)
    >>> float(heights.std().round(12))
    0.2
    """
    positions = np.asarray(positions, dtype=float).reshape(len(positions), -1)
    random, lengths = np.random.default_rng(seed), np.geomspace(*wavelengths, waves)
    angle = random.uniform(0, np.pi, waves) if positions.shape[1] == 2 else np.zeros(waves)
    vectors = 2 * np.pi / lengths * np.stack([np.cos(angle), np.sin(angle)])[: positions.shape[1]]
    heights = np.cos(positions @ vectors + random.uniform(0, 2 * np.pi, waves)) @ lengths**power
    return roughness / heights.std() * heights


def write_profile(path: Path, x: np.ndarray, heights: np.ndarray) -> None:
    """Write positions and heights (m,) to a CSV file with a line of names."""
    with write_aside(path) as aside:
        np.savetxt(aside, np.stack([x, heights], axis=1), delimiter=",", header="x,height")


def write_profile_for_paraview(path: Path, profile: SmoothRoad, x: np.ndarray) -> None:
    """Write a profile at positions (m,) as a line with height and normal, NAME.xdmf, for ParaView."""
    from model.results.xdmf import FacetMesh

    points = np.stack([x, profile.height(x[:, None])], axis=1)
    count = np.arange(len(x) - 1)
    mesh = FacetMesh(points, np.stack([count, count + 1], axis=1))
    normal = profile.closest(points)[1]
    write_xdmf(path, mesh, {"height": points[mesh.order, 1], "normal": normal[mesh.order]})


def note_profile(scene: Scene, x: np.ndarray, heights: np.ndarray, profile: SmoothRoad) -> None:
    """Note the extremes of the sampled heights (m,), and the slope of the profile through them."""
    scene.result("highest_summit", heights.max(), "m")
    scene.result("deepest_hollow", heights.min(), "m")
    scene.result("slope", np.std(profile.slope(x[:, None])), "1, standard deviation")
