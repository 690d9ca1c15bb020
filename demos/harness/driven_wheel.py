"""A cylinder on a rigid hub that rolls under torque, load step by load step, as its hub sees it: the road turns."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, Support
from geometry import Body, Grid, MovingRoad, Plane
from model import BodyOnRoad, Carter, FiniteContact, HertzCylinder, Status, follow

R, E = 10.0, 210e3  # mm, MPa: the cylinder of the paper
HUB = 0.5 * R
GROWTH = 1.2  # of cells away from the contact
PRESSING = 8  # load steps until P and Q act


class Rolled(NamedTuple):
    """A way rolled under constant forces; of the last half width of contact.

    Attributes
    ----------
    creep : float
        Way of the hub's centre along the road less R times its turn, over the latter.
    work : float
        What friction takes, over R times the turn (N/mm).
    stick : float
        Part of the nodes in contact that stick.
    """

    creep: float
    work: float
    stick: float


class Creepage(NamedTuple):
    """Steady rolling under torque beside Carter's closed form.

    Attributes
    ----------
    creepage : float
        The creep of free rolling taken off.
    closed : Carter
    work : float
        What friction takes, over Q times R times the turn times the creepage: 1.
    stick : float
        Part of the nodes in contact that stick.
    """

    creepage: float
    closed: Carter
    work: float
    stick: float

    @property
    def off(self) -> float:
        """Error of the creepage, of the closed form."""
        return self.creepage / self.closed.creepage - 1.0


def creepage(
    P: float,
    nu: float,
    cells: int,
    steps: int,
    part: float = 0.75,
    mu: float = 0.5,
    way: float = 3.0,
    finite: bool = True,
) -> Creepage:
    """Roll a cylinder freely, and under Q = part mu P.

    Parameters
    ----------
    P : float
        Load per length (N/mm).
    cells, steps : int
        Cells in half the width of the contact, and load steps in the width of a cell.
    way : float
        To roll, of the half width; after two of them the rolling is steady.
    finite : bool
        Neo-Hookean of finite strain, or linear.
    """
    hertz = HertzCylinder(P=P, R=R, E=E, nu=nu)
    Q = part * mu * P
    free, driven = (rolled(hertz, force, mu, cells, steps, way, finite) for force in (0.0, Q))
    found = free.creep - driven.creep
    return Creepage(found, Carter(hertz, Q=Q, mu=mu), driven.work / (Q * found), driven.stick)


def rolled(
    hertz: HertzCylinder, Q: float, mu: float, cells: int, steps: int, way: float, finite: bool
) -> Rolled:
    """Press a cylinder by P, let Q drive it (N/mm), and roll it on through its lowest point.

    In the axes of its hub, which does not turn but shifts, the road goes round it, and the forces with the road.
    """
    a, nu, P = hertz.a, hertz.nu, hertz.P
    start, reach = -0.5 * way * a / R, (0.5 * way + 2.0) * a
    body = Body.from_grid(graded_ring(reach, a / cells, 0.5 * a))
    elastic = (
        Hyperelasticity(body, NeoHookean(E, nu), mean_dilatation=True)
        if finite
        else Elasticity(body, Isotropic(E, nu), mean_dilatation=True)
    )
    times = np.concatenate(
        [
            np.arange(1, PRESSING + 1) / PRESSING,
            1.0 + np.arange(1, round(way * cells * steps) + 1) / (cells * steps),
        ]
    )
    unit = [elastic.total_force("hub", axis) for axis in np.eye(2)]

    def along(t: float) -> np.ndarray:  # the road, from time 1 on by a half width in a unit of time
        angle = start + max(t - 1.0, 0.0) * a / R
        return np.array([np.cos(angle), np.sin(angle)])

    def load(t: float) -> np.ndarray:
        (c, s), q, p = along(t), -Q * min(t, 1.0), -P * min(t, 1.0)
        return unit[0] * (c * q - s * p) + unit[1] * (s * q + c * p)

    road = MovingRoad(
        Plane((R * np.sin(start), R - R * np.cos(start)), (-np.sin(start), np.cos(start))),
        lambda t: -max(t - 1.0, 0.0) * a * along(t),
        turn=lambda t: max(t - 1.0, 0.0) * a / R,
        centre=(0.0, R),
    )
    system = elastic.system(load, Support(body).platen("hub"))
    contact = BodyOnRoad(system, "tread", road, friction=mu, reach=(reach + a) ** 2 / R)
    path = (
        FiniteContact(contact).follow(times, times[0])
        if finite
        else follow(contact, times, correction="direct")
    )
    hub, nodes = body.nodes("hub")[0], contact.problem.contact_nodes
    centre, work, stick, before = [], [], [], None
    for t, solution in zip(times, path, strict=True):
        points, x = contact.points + solution.displacement[nodes], along(t)
        traction = solution.contact_force @ x
        if before is not None:
            slip = (points - road.carried(before[0], before[1], t)) @ x
            work.append(-float(0.5 * (before[2] + traction) @ slip))
        before = points, t, traction
        centre.append(float(contact.displacement(solution)[hub] @ x))
        stick.append(np.sum(solution.status == Status.STICK) / np.sum(solution.status != Status.FREE))
    last = cells * steps
    return Rolled((centre[-1] - centre[-1 - last]) / a, sum(work[-last:]) / a, float(np.mean(stick[-last:])))


def graded_ring(reach: float, size: float, depth: float) -> Grid:
    """A ring of radius R on a hub: even cells along the tread to `reach` on both sides of the lowest point (mm).

    They are as deep as wide to `depth`; from there all grow. Boundaries `tread` and `hub`.
    """
    half = _growing(size / R, reach / R, np.pi)
    angle = np.concatenate([-half[:0:-1], half[:-1]])
    radius = R - _growing(size, depth, R - HUB)
    points = np.array([(r * np.sin(w), R - r * np.cos(w)) for r in radius for w in angle])
    number = np.arange(len(points)).reshape(radius.size, angle.size)
    ahead = np.roll(number, -1, axis=1)
    cells = np.stack([number[:-1], ahead[:-1], number[1:], ahead[1:]], axis=-1).reshape(-1, 4)
    sides = {name: np.stack([number[k], ahead[k]], axis=-1) for name, k in (("tread", 0), ("hub", -1))}
    return Grid(points, cells, "quadrilateral", sides)


def _growing(size: float, even: float, end: float) -> np.ndarray:
    """Positions from 0 to `end`: steps of `size` to `even`, then growing by GROWTH or a little less."""
    first = size * np.arange(np.ceil(even / size) + 1)
    left = (end - first[-1]) / size
    count = int(np.ceil(np.log(1.0 + left * (GROWTH - 1.0) / GROWTH) / np.log(GROWTH)))
    powers = np.arange(1, count + 1)
    growth = brentq(lambda q: float(np.sum(q**powers)) - left, 1.0, 2.0 * GROWTH)
    return np.concatenate([first, first[-1] + size * np.cumsum(growth**powers)])


def note_creepage(scene):
    """Note the creep under torque; the load is small, so that linear strain will do, seen from the hub."""
    mesh, way = ((4, 1), 2.5) if scene.quick else ((8, 2), 3.0)
    driven = creepage(100.0, 0.49, *mesh, finite=False, way=way)
    scene.result("creepage", driven.creepage, "1", driven.closed.creepage, "Carter")
