"""A ring riding over a road: its run, the spectrum of its surface velocity, and its hardest step."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.signal import welch

from geometry import Plane
from harness.scene import Scene
from model import ContactProblem, ContactStabilised, History, Solution, integrate, solve
from model.dynamics.curved_steps import on_curved_road
from model.dynamics.moving_body import RigidPart


class Ride:
    """A run over a road, with what is asked of it: how far nodes are off the road, how the surface vibrates.

    Parameters
    ----------
    moving : MovingBody
    road : Road
        Its own.
    velocity : (N, 2)
        At the start.
    dt, end : float
    points : dict
        Nodes to follow, by name.
    integrator : type of TimeIntegrator
    on_step : callable, optional
        Called with each state.

    Attributes
    ----------
    history : History
    off : float
        Largest distance of a touching node from the road.
    surface : (steps, n, 2)
        Velocity of the nodes that may touch, the motion as a rigid body taken out.
    pressed : (state, state, (n, 2))
        Before and after the step with the greatest force of the road, and its normals.
    """

    def __init__(
        self,
        moving: Any,
        road: Any,
        velocity: np.ndarray,
        dt: float,
        end: float,
        points: dict[str, int],
        integrator: Any = ContactStabilised,
        on_step: Callable[[Any], None] | None = None,
    ):
        self.moving, self.road = moving, road
        self.scheme = (integrator if isinstance(road, Plane) else on_curved_road(integrator))(moving, dt)
        before = self.scheme.start(velocity=velocity)
        self.history = History(self.scheme, before, points)
        rigid, nodes = RigidPart(self.scheme.M, moving.coordinates), moving.contact_nodes
        self.off, surface, hardest = 0.0, [], 0.0
        for state in integrate(self.scheme, before, round(end / dt), self.history):
            touching = nodes[state.status > 0]
            if touching.size:
                at = moving.coordinates[touching] + state.displacement[touching]
                self.off = max(self.off, np.abs(road.closest(at)[0]).max())
            surface.append(rigid.deformation(state.velocity)[nodes])
            force = state.contact_force[:, 1].sum()
            if force > hardest:
                hardest = force
                self.pressed = before, state, self.scheme.solvers["step"].loop.frame[:, 0].copy()
            if on_step is not None:
                on_step(state)
            before = state
        self.surface, self.hardest = np.array(surface), hardest

    def spectrum(self, since: float) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies (Hz), and power spectral density of the surface velocity, mean over the nodes.

        Parameters
        ----------
        since : float
            Time from which on the velocity counts (s).
        """
        rate = 1 / self.scheme.dt
        velocity = self.surface[round(since * rate) :]
        window = min(len(velocity), round(0.25 * rate))
        frequency, power = welch(velocity, rate, nperseg=window, axis=0)
        return frequency, power.sum(axis=2).mean(axis=1)

    def hardest_step(self, friction: float) -> tuple[ContactProblem, Solution, float]:
        """The step with the greatest force as a problem on a plane at each node, its solution, and its distance.

        The planes are those at which the step's rounds have ended. Its unknown is measured from 1 cm above the
        guess, where no gap is negative; solved anew from nothing it is the same step, up to the distance (m).
        """
        before, after, normal = self.pressed
        scheme, moving, nodes, up = self.scheme, self.moving, self.moving.contact_nodes, (0.0, 0.01)
        A, (guess, _) = scheme.effective_matrix(), scheme.guess(before)
        b = moving.missing_force(before.time, before.displacement + 0.5 * guess, guess / scheme.dt)
        b = b - (A @ np.broadcast_to(up, guess.shape).ravel()).reshape(guess.shape)
        moved, was = guess + up, moving.coordinates[nodes] + before.displacement[nodes]
        above = was + moved[nodes]
        _, _, foot = self.road.closest(moving.coordinates[nodes] + after.displacement[nodes])
        gap, back = np.einsum("ca,ca->c", normal, above - foot), self.road.closest(was)[2] - above
        problem = ContactProblem(A, b, moving.coordinates, nodes, normal, gap, friction, back)
        again = solve(problem, "direct")
        distance = np.abs(again.displacement - (after.displacement - before.displacement - moved)).max()
        return problem, again, float(distance)


def note_ride(scene: Scene, key: str, ride: Ride, kinetic: float, fall: float) -> None:
    """Note how a ride keeps to the road, to the laws of contact, and to its energy; as [key] behind each result."""
    history, of_start, length = ride.history, "of the initial kinetic energy", "body lengths"
    gain, change = history["gain"].max(), history["total"][-1] - history["total"][0]
    lost, momentum = history["friction"][-1], history["momentum_error"].max()
    bounces = history.bounces(apart=0.05)
    scene.result(f"off_the_road[{key}]", ride.off, length, 1e-12, "wanted", "at most")
    scene.result(f"min_gap[{key}]", history["lowest_gap"].min(), "m", 0.0, "eq. (5)")
    scene.result(f"min_pressure[{key}]", history["lowest_pressure"].min(), "N/m, nodal force", 0.0, "eq. (6)")
    scene.result(f"max_coulomb_violation[{key}]", history["cone"].max(), "N/m", 0.0, "eq. (7)")
    scene.result(f"max_energy_gain[{key}]", gain / kinetic, f"{of_start}, in a step", 0.0, "never gained")
    scene.result(f"energy_change[{key}]", change / kinetic, f"{of_start}, friction counted", 0.0)
    scene.result(f"lost_to_friction[{key}]", lost / kinetic, of_start)
    scene.result(f"momentum_error[{key}]", momentum, "N s/m", 0.0)
    scene.result(f"first_touch[{key}]", bounces[0][0], "s", fall, "sqrt(2 h / g), from the mean height")
    if len(bounces) > 1:
        scene.result(f"second_touch[{key}]", bounces[1][0], "s")
    scene.result(f"greatest_force[{key}]", ride.hardest, "N/m")
    fewest = history.resolution.fewest
    scene.result(f"steps_per_wave_period[{key}]", fewest, "1", 10, "what it takes", "at least")


def octave_level(spectrum: tuple, beside: tuple, centre: float) -> float:
    """Level (dB) of one spectrum over another, (frequencies, power), in the octave about a frequency (Hz)."""
    frequency = spectrum[0]
    octave = (frequency >= centre / np.sqrt(2)) & (frequency < centre * np.sqrt(2))
    return float(10 * np.log10(spectrum[1][octave].sum() / beside[1][octave].sum()))


def note_spectra(scene: Scene, spectra: dict[str, tuple], octaves: Sequence[float]) -> None:
    """Note the level of each surface velocity, and by octaves that on the rough road over that on the plane one."""
    for name, (frequency, power) in spectra.items():
        rms = np.sqrt(np.trapezoid(power, frequency))
        scene.result(f"surface_velocity[{name.split()[0]}]", rms, "m/s, rms from the first touch on")
    for centre in octaves:
        level = octave_level(spectra["rough road"], spectra["plane road"], centre)
        scene.result(f"level_of_rough_over_plane[{centre:g} Hz]", level, "dB, octave")
