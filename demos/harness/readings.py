"""What is read off a contact on a line, and noted as results of a scene."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from harness.scene import Scene
from model import Status, line_error
from model.results.pressure import HalfWidth, contact_half_width


class Patch(NamedTuple):
    """A contact patch on a horizontal road in the plane, its n candidates in rising order of x.

    Attributes
    ----------
    x, p, tau, status : (n,)
        Positions, pressures, shear tractions of the road on the body along x, and 0 free, 1 slip, 2 stick.
    width : HalfWidth
    """

    x: np.ndarray
    p: np.ndarray
    tau: np.ndarray
    status: np.ndarray
    width: HalfWidth

    def zone(self, status: int) -> tuple[float, float]:
        """First and last position of the nodes with at least this status."""
        x = self.x[self.status >= status]
        return float(x.min(initial=np.inf)), float(x.max(initial=-np.inf))


def read_patch(pressed: Any, solution: Any, degree: int = 1) -> Patch:
    """Read the patch off a solution.

    Parameters
    ----------
    pressed : BodyOnRoad
    solution : Solution
    degree : int
        As for `contact_half_width`: 1 without friction, 2 with.
    """
    order = np.argsort(pressed.points[:, 0])
    x, p, status = pressed.points[order, 0], pressed.pressure(solution)[order], solution.status[order]
    width = contact_half_width(x, p, status != Status.FREE, degree)
    return Patch(x, p, pressed.traction(solution)[order, 0], status, width)


def last_slip(pressed: Any, solutions: Sequence[Any]) -> np.ndarray:
    """Slip along x (n,) in the last step of a path, in rising order of x as in a `Patch`; 0 where nothing slips."""
    before, last = solutions[-2:]
    slip = (last.displacement - before.displacement)[pressed.problem.contact_nodes, 0]
    return np.where(last.status == Status.SLIP, slip, 0.0)[np.argsort(pressed.points[:, 0])]


def save_last_step(
    file: Path, pressed: Any, solutions: Sequence[Any], load: np.ndarray | None = None
) -> None:
    """Save the last step of a path as a problem of its own: NAME.npz, with the step's solution.

    Parameters
    ----------
    file : Path
    pressed : BodyOnRoad
    solutions : sequence of Solution
        Of the steps; nodes stick where the last but one has left them.
    load : (N, dim), optional
        Of the last step; default the problem's own.
    """
    before = solutions[-2].displacement[pressed.problem.contact_nodes]
    load = pressed.problem.b if load is None else load
    replace(pressed.problem, b=load, tangential_reference=before).save(file, solutions[-1])


def radius_in_space(pressed: Any, solution: Any) -> float:
    """Radius of a round patch about the origin: the squares of the pressures lie on a parabola over r, to its end."""
    r, p = np.hypot(*pressed.points[:, :2].T), pressed.pressure(solution)
    inner = (solution.status > 0) & (r < 0.85 * r[solution.status > 0].max())
    slope, top = np.polyfit(r[inner] ** 2, p[inner] ** 2, 1)
    return float(np.sqrt(-top / slope))


def sticking_share(pressed: Any, solution: Any) -> float:
    """Part of the area in contact that sticks."""
    sticking, touching = (pressed.area[solution.status >= kind].sum() for kind in (Status.STICK, Status.SLIP))
    return float(sticking / touching)


def coulomb_violation(pressed: Any, solutions: Sequence[Any], mu: float) -> float:
    """Largest |tau| - mu p over some solutions, at least 0, as a part of their largest pressure.

    The last axis is the normal of the road.
    """
    worst = highest = 0.0
    for solution in solutions:
        p = solution.pressure_force / pressed.area
        tau = np.linalg.norm(pressed.traction(solution)[:, :-1], axis=1)
        worst, highest = max(worst, np.max(tau - mu * p)), max(highest, p.max())
    return float(worst / highest)


def note_laws(
    scene: Scene, name: str, pressed: Any, solutions: Sequence[Any], force: Any, mu: float = 0.0
) -> None:
    """Note how well the laws of contact are kept, which have no mesh error: (5), (6), (7) and equilibrium.

    Parameters
    ----------
    scene : Scene
        Gets min_gap[name], min_pressure[name], max_coulomb_violation[name] and force_balance_error[name].
    name : str
    pressed : BodyOnRoad
    solutions : sequence of Solution
        All steps; the last one carries `force`.
    force : (dim,)
        Of the road on the body, in equilibrium.
    mu : float
        Coulomb's coefficient.
    """
    last, force = solutions[-1], np.asarray(force, dtype=float)
    off = np.abs(last.contact_force.sum(axis=0) - force)[force != 0.0 if not mu else slice(None)]
    scene.result(f"min_gap[{name}]", min(s.gap.min() for s in solutions), "mm", 0.0, "eq. (5)")
    scene.result(
        f"min_pressure[{name}]", min(s.pressure_force.min() for s in solutions), "N/mm", 0.0, "eq. (6)"
    )
    scene.result(
        f"max_coulomb_violation[{name}]", coulomb_violation(pressed, solutions, mu), "p0", 0.0, "eq. (7)"
    )
    scene.result(f"force_balance_error[{name}]", off.max() / np.abs(force).max(), "1", 0.0, "equilibrium")


def note_even(scene: Scene, contact: Any, solution: Any, expected: float) -> None:
    """Note a pressure (MPa) that should be the same at every node, and the least gap."""
    p = contact.pressure(solution)
    scene.result("pressure", p.mean(), "MPa", expected, "eq. (a)")
    scene.result("largest_error_of_pressure", abs(p / expected - 1).max(), "1", 0.0, "eq. (a)")
    scene.result("min_gap[plane]", solution.gap.min(), "mm", 0.0, "eq. (5)")


def note_uncoupled(
    scene: Scene, pressed: Any, solution: Any, mindlin: Any, mu: float
) -> tuple[Patch, tuple[float, float]]:
    """Note a patch and its stick zone beside Cattaneo and Mindlin's (14); return it, centred, and the zone (mm).

    Over the stick zone mu p - |tau| is an ellipse, whose zeros locate c between the nodes.
    """
    patch, a = read_patch(pressed, solution), mindlin.normal.a
    patch = patch._replace(x=patch.x - patch.width.centre)
    zone = contact_half_width(patch.x, mu * patch.p - abs(patch.tau), patch.status == Status.STICK)
    error = line_error(patch.x, abs(patch.tau), mindlin.traction)
    middle = "eq. (14), from the middle of the patch"
    scene.result("c_over_a[uncoupled]", zone.interpolated / a, "1", 0.5, "eq. (15)")
    scene.result("tau_L2_error[uncoupled]", error, "1", 0.0, "eq. (14)")
    scene.result("patch_centre[uncoupled]", patch.width.centre, "mm", 0.0, "eq. (14)")
    scene.result("stick_centre[uncoupled]", zone.centre, "mm", 0.0, middle)
    return patch, (zone.centre - zone.interpolated, zone.centre + zone.interpolated)


def note_hill(scene: Scene, hill: Any, solution: Any) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Note who touches on a hill, the least gap and the residual; return the tractions over x by name."""
    scene.result("nodes_in_contact[hill]", np.count_nonzero(solution.status), "1")
    scene.result("min_gap[hill]", solution.gap.min(), "mm", 0.0, "eq. (5)")
    scene.result("residual[hill]", solution.residual, "1", 1e-10, "asked for", "at most")
    patch = read_patch(hill, solution)
    return {"pressure": (patch.x, patch.p), "traction along x": (patch.x, patch.tau)}


def note_zone(
    scene: Scene,
    key: str,
    name: str,
    zone: tuple[float, float],
    half_width: float | None = None,
    source: str | None = None,
) -> None:
    """Note where a zone begins and ends (mm), as key_from[name] and key_to[name], beside -half_width and half_width."""
    for end, place, sign in zip(("from", "to"), zone, (-1, 1)):
        exact = None if half_width is None else sign * half_width
        scene.result(f"{key}_{end}[{name}]", place, "mm", exact, source)


def note_pulled(
    scene: Scene, name: str, patch: Patch, slip: np.ndarray, hertz: Any, last: Any, Q: float
) -> None:
    """Note peak, stick zone and contact zone of a patch that is pulled along by Q, and that friction opposes slip."""
    scene.result(f"p0[{name}]", patch.p.max(), "MPa", hertz.p0, "Hertz, frictionless")
    note_zone(scene, "stick", name, patch.zone(Status.STICK))
    note_zone(scene, "contact", name, patch.zone(Status.SLIP), hertz.a, "Hertz, frictionless")
    scene.result(f"tangential_force_error[{name}]", abs(last.contact_force[:, 0].sum() / Q + 1), "1", 0.0)
    power = (patch.tau * slip).max()
    scene.result(f"max_slip_power[{name}]", power, "MPa mm", 0.0, "friction opposes slip", "at most")
