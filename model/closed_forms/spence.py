"""Half-plane solution of a cylinder pressed on a rough plane, with coupled stick and slip (Spence 1975).

The surface of the cylinder, taken as a half plane, moves inwards as it is pressed, and friction drags it
outwards. D. A. Spence (J. Elasticity 5 (1975) 297) showed that under a growing load the stick ratio c/a keeps
its value, and that it is that of a flat punch: each increment of the load rests inside c and slips between c
and a, q = mu p. The contact of the cylinder is the sum of the flat punches that it grew through.

With the pressure p and the outward traction q on |x| < a, Johnson, Contact Mechanics (1985), (2.25) reads

    E*/2 du_z/dx = -1/pi int p(s) / (x - s) ds + beta q        (into the body)
    E*/2 du_x/dx = -1/pi int q(s) / (x - s) ds - beta p        (along the surface)

with Dundurs' beta = (1 - 2 nu) / (2 (1 - nu)). The punch has du_z/dx = 0 where it touches and du_x/dx = 0
where it sticks. Both are integrated once, so that the kernel is a logarithm, and collocated on panels of
constant p and q, graded towards the end of the stick zone and towards the edge; c is where q comes out
continuous. The errors of c/a, a and p0 are 1e-4 or less, and fall with the number of panels squared.

This is a half-plane theory, and more sensitive than Hertz's to the rest of the body: a cylinder under load
stretches along the plane as a whole, by a strain of order a/R, which takes from the inward motion that
friction resists. Finite elements on the half cylinder meet it for a/R = 0.0007 (mu = 0.2: traction within 0.7
%, mu = 0.5: p0 within 0.1 %), but at the paper's a/R = 0.074 they find p0/p0_Hertz = 1.070 rather than 1.078
at mu = 0.5, and c/a = 0.53 rather than 0.36 at mu = 0.2.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import ellipkm1, expit, log_expit, xlog1py, xlogy

from checks import instance, numbers, poisson_ratio, positive
from model.closed_forms.hertz import HertzCylinder

PANELS = 100  # in the stick zone, and as many in the slip zone: errors of 1e-4 (above)
# log(c / (1 - c)): below the first the panels cannot tell the stick zone (1e-7 of the patch) from a point,
# above the second the slip zone (1e-11 of it) does not matter
ALL_SLIPS, ALL_STICKS = -16.0, 25.0


def dundurs_beta(nu: float) -> float:
    """(1 - 2 nu) / (2 (1 - nu)), Dundurs' second parameter of an elastic body on a rigid one in plane strain.

    Raises
    ------
    ValueError
        If nu is out of range.

    Examples
    --------
    >>> round(dundurs_beta(0.3), 4)
    0.2857
    """
    poisson_ratio(nu)
    return (1 - 2 * nu) / (2 * (1 - nu))


def goodman_stick_ratio(mu: float, nu: float) -> float:
    """c/a if friction left the pressure alone (Goodman 1962, Spence 1975): K(c/a) / K'(c/a) = mu / beta.

    Parameters
    ----------
    mu : float
        Coefficient of friction.
    nu : float
        Poisson's ratio.

    Raises
    ------
    ValueError
        If mu is not positive or nu is out of range.

    Examples
    --------
    >>> round(goodman_stick_ratio(mu=0.5, nu=0.3), 3)
    0.968
    """
    positive(mu=mu)
    beta = dundurs_beta(nu)
    return 1.0 if beta == 0 else float(expit(_log_ratio(mu / beta)))


@dataclass(frozen=True)
class Spence:
    """A cylinder pressed on a rigid plane with friction, by a load that only grows.

    Parameters
    ----------
    normal : HertzCylinder
        The same contact without friction.
    mu : float
        Coefficient of friction.

    Raises
    ------
    ValueError
        If mu is not positive.

    Examples
    --------
    >>> rough = Spence(HertzCylinder(P=1e4, R=10.0, E=210e3, nu=0.3), mu=0.5)
    >>> round(rough.p0 / rough.normal.p0, 3), round(rough.c / rough.a, 2)
    (1.078, 0.94)
    """

    normal: HertzCylinder
    mu: float

    def __post_init__(self) -> None:
        """Check the number once."""
        instance(HertzCylinder, normal=self.normal)
        positive(mu=self.mu)

    @property
    def punch(self) -> "Punch":
        """The flat punch of half width 1 under a unit load."""
        return unit_punch(self.mu, self.normal.nu)

    @property
    def a(self) -> float:
        """Half width of the patch (mm): a = a_Hertz sqrt(J), J from the profile of the punch outside it."""
        return self.normal.a * float(np.sqrt(self.punch.growth))

    @property
    def c(self) -> float:
        """Half width of the stick zone (mm)."""
        return self.a * self.punch.stick_ratio

    @property
    def p0(self) -> float:
        """Greatest pressure, 2 P / a times the punch's pressure in the middle (MPa)."""
        return 2 * self.normal.P / self.a * float(self.punch.pressure[0])

    def pressure(self, x: ArrayLike) -> np.ndarray:
        """Contact pressure at x (mm), 0 outside the patch (MPa)."""
        return self._sum_of_punches(x, self.punch.pressure)

    def traction(self, x: ArrayLike) -> np.ndarray:
        """Traction of the plane on the cylinder at x, along +x (MPa): outwards, so it has the sign of x."""
        return np.sign(numbers("x", x)) * self._sum_of_punches(x, self.punch.traction)

    def _sum_of_punches(self, x: ArrayLike, profile: np.ndarray) -> np.ndarray:
        """2 P / a |X| int_|X|^1 profile(t) / t^2 dt, X = x / a: the punches of half width |x| to a, at x."""
        edges = self.punch.edges
        X = np.abs(numbers("x", x)) / self.a
        i = np.clip(np.searchsorted(edges, X, side="right") - 1, 0, profile.size - 1)
        beyond = np.append(np.cumsum((profile[1:] * (1 / edges[1:-1] - 1 / edges[2:]))[::-1])[::-1], 0)
        inside = X * beyond[i] + profile[i] * (1 - X / edges[i + 1])
        return 2 * self.normal.P / self.a * np.where(X < 1, inside, 0)


class Punch(NamedTuple):
    """Contact of a flat punch, 0 < x < 1: pressure is even, traction odd.

    `edges` (n + 1,) bound the panels, `pressure` and `traction` (n,) are constant on each; `growth` is J,
    with P = pi E* a^2 / (4 R J) for the cylinder that grows through such punches (J = 1: Hertz).
    """

    stick_ratio: float
    edges: np.ndarray
    pressure: np.ndarray
    traction: np.ndarray
    growth: float


@lru_cache
def unit_punch(mu: float, nu: float, panels: int = PANELS) -> Punch:
    """Stick ratio and profiles of a flat punch of half width 1 under a unit load.

    Parameters
    ----------
    mu : float
        Coefficient of friction.
    nu : float
        Poisson's ratio.
    panels : int
        Panels in the stick zone, and in the slip zone.

    Raises
    ------
    ValueError
        If mu is not positive, or too small to leave a stick zone, or nu is out of range.

    Examples
    --------
    >>> round(unit_punch(mu=0.2, nu=0.3).stick_ratio, 2)
    0.36
    """
    positive(mu=mu)
    beta = dundurs_beta(nu)

    def jump(log_ratio: float) -> float:
        """Traction just inside the end of the stick zone less mu p just outside."""
        _, _, p, q = _solve(log_ratio, mu, beta, panels)
        return float(q[panels - 1] - mu * p[panels - 1])

    # Goodman's estimate, with arctan(mu) and artanh(beta) for mu and beta it comes close in the coupled case
    # too
    log_ratio = _log_ratio(np.arctan(mu) / np.arctanh(beta)) if beta > 0 else ALL_STICKS
    if log_ratio < ALL_SLIPS:
        raise ValueError(
            f"mu = {mu:g} leaves less than 1e-7 of the patch to stick at nu = {nu:g}: take Hertz's formulas."
        )
    if log_ratio < ALL_STICKS:
        reach = 0.5
        while jump(log_ratio - reach) * jump(log_ratio + reach) > 0:
            reach *= 1.5
        # ten digits of c, of which the panels leave four
        log_ratio = brentq(jump, log_ratio - reach, log_ratio + reach, xtol=1e-10)
    x, d, p, q = _solve(log_ratio, mu, beta, panels)
    # J = int_-1^1 p(s) (-log(1 - s^2) / (2 s^2)) ds: the slopes outside the punches add up to the cylinder's
    # x / R
    G = np.zeros_like(x)
    G[1:] = (xlog1py(1 + x[1:], x[1:]) + xlogy(d[1:], d[1:])) / x[1:]
    return Punch(float(expit(log_ratio)), x, p, q, float(p @ np.diff(G)))


def _log_ratio(modulus: float) -> float:
    """Find log(c / (1 - c)) where K(c) / K'(c) equals `modulus`, between -300 and ALL_STICKS."""

    def excess(v: float) -> float:
        c, slip = expit(v), expit(-v)
        return float(ellipkm1(slip * (1 + c)) / ellipkm1(c**2) - modulus)

    if excess(-300) >= 0:
        return -300
    return ALL_STICKS if excess(ALL_STICKS) <= 0 else brentq(excess, -300, ALL_STICKS)


def _solve(log_ratio: float, mu: float, beta: float, panels: int) -> tuple[np.ndarray, ...]:
    """Panel edges x, their distances 1 - x from the end, p and q, for c / (1 - c) = exp(log_ratio)."""
    x, d = _edges(log_ratio, panels)
    n, width = 2 * panels, np.where(x[1:] < 0.5, np.diff(x), -np.diff(d))
    middle, middle_d = (x[1:] + x[:-1]) / 2, (d[1:] + d[:-1]) / 2
    # int log|x - s| ds over each panel and over its mirror image; the smaller of x and 1 - x keeps the digits
    z = np.where(middle[:, None] < 0.5, middle[:, None] - x, d - middle_d[:, None])
    same = -np.diff(xlogy(z, np.abs(z)) - z)
    z = middle[:, None] + x
    mirror = np.diff(xlogy(z, z) - z)
    sum_to_middle = np.tril(np.tile(width, (n, 1)), -1) + np.diag(width / 2)

    normal, along = (same + mirror) / np.pi, (same - mirror) / np.pi
    slip = np.diag(np.repeat([0.0, mu], panels))  # q = slip p + stick q_stick
    stick = np.eye(n)[:, :panels]
    total = beta * sum_to_middle
    touches = np.hstack([total @ slip - normal, total @ stick, -np.ones((n, 1))])
    rests = np.hstack([-total - along @ slip, -along @ stick, np.zeros((n, 1))])[:panels]
    load = np.concatenate([2 * width, np.zeros(panels + 1)])
    unknowns = np.linalg.solve(np.vstack([touches, rests, load]), np.append(np.zeros(n + panels), 1))
    p = unknowns[:n]
    return x, d, p, slip @ p + stick @ unknowns[n : n + panels]


def _edges(log_ratio: float, panels: int) -> tuple[np.ndarray, np.ndarray]:
    """Panel edges and their distances from 1, graded towards 0, c and, more strongly, the edge."""
    z = np.linspace(0, np.pi / 2, panels + 1)
    log_d = np.sin(z) ** 2 * log_expit(-log_ratio)  # from 0 to log(1 - c)
    log_x = np.cos(z)[1:] ** 4 * log_expit(log_ratio)  # from log c to 0
    log_x[-1] = 0
    x = np.concatenate([-np.expm1(log_d), np.exp(log_x)])
    d = np.concatenate([np.exp(log_d), -np.expm1(log_x)])
    return x, d
