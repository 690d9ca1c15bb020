"""Rings that turn: how far, how wide, their weight on the road, and the velocities of steady rolling."""

from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, Support
from geometry import Body, Plane, ring
from harness.motion import write_motion
from harness.scene import Scene
from model import (
    BodyOnRoad,
    EnergyMomentum,
    FiniteBody,
    FiniteContact,
    History,
    LosslessContact,
    MassRedistribution,
    MovingBody,
    integrate,
)
from model.dynamics.step_problem import save_step

GRAVITY = 9.81  # m/s^2
# Of an independent program, same mesh and dt: second touch (s), rotation at 0.9 s (rad), energy at 1.3 s (J/m).
MARKS = {
    "finite, mu=0": (1.04, 0.0, 32.57),
    "finite, mu=0.1": (1.03, -1.141, 24.95),
    "finite, mu=0.5": (0.97, -5.38, 17.67),
}


def wheel(
    E: float,
    mu: float | None,
    mesh: tuple[int, int] = (96, 6),
    height: float = 0.0,
    weight: tuple[float, float] = (0.0, -GRAVITY),
) -> FiniteBody:
    """Ring of the paper (radii 0.5 and 0.2 m, density 1, nu = 0.3) of neo-Hookean rubber above a road."""
    body = Body.from_grid(ring(0.5, 0.2, *mesh, lowest=(0.0, height)))
    elastic = Hyperelasticity(body, NeoHookean(E, nu=0.3))
    return FiniteBody.from_forms(elastic, 1.0, elastic.body_force(weight), Plane(), "outer", friction=mu)


def paper_ring(mu: float, finite: bool, dt: float = 0.01) -> tuple[Any, Elasticity]:
    """The paper's ring half a metre above the road: an integrator, of linear or of finite strain, and its forms."""
    moving = wheel(1000.0, mu or None, height=0.5)
    if finite:
        return EnergyMomentum(moving, dt), moving.elastic
    linear = Elasticity(moving.elastic.body, Isotropic(E=1000.0, nu=0.3))
    weight = linear.body_force((0.0, -GRAVITY))
    body = MovingBody.from_forms(linear, 1.0, weight, moving.road, "outer", friction=mu or None)
    return MassRedistribution(body, dt), linear


def sagged(moving: FiniteBody, weight: float = GRAVITY) -> np.ndarray:
    """Displacement (N, 2) under its own weight on the road."""
    elastic = moving.elastic
    x, support = moving.coordinates, Support(elastic.body)
    for y in (x[:, 1].min(), x[:, 1].max()):
        support.fix_node(elastic.body.nearest_node((0.0, y)), x=0.0)
    contact = BodyOnRoad(elastic.system(elastic.body_force((0.0, -weight)), support), "outer", Plane())
    return contact.displacement(FiniteContact(contact).solve())


def turn(before: np.ndarray, after: np.ndarray) -> float:
    """Mean rotation (rad, -pi to pi) from positions (N, 2) to positions (N, 2)."""
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    return float(np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b)))


def mean_radius(moving: Any, u: np.ndarray) -> float:
    """Mean distance of the outer nodes from their centre (m)."""
    x = (moving.coordinates + u)[moving.contact_nodes]
    return float(np.linalg.norm(x - x.mean(axis=0), axis=1).mean())


class Turned(NamedTuple):
    """A run of a ring.

    Attributes
    ----------
    history : History
    radius, angle : (steps + 1,)
        Mean outer radius (m), and rotation (rad).
    outline : (n, 2)
        Outer nodes at 0.9 s (m).
    """

    history: History
    radius: np.ndarray
    angle: np.ndarray
    outline: np.ndarray


def turned(scheme: Any, elasticity: Any = None, path: Path | None = None, save: Path | None = None) -> Turned:
    """Launch a ring at 10 m/s along its road and run 130 steps of 0.01 s.

    Parameters
    ----------
    scheme : TimeIntegrator
    elasticity : forms.Elasticity, optional
        Its forms, for the series of fields at `path`, NAME.xdmf; the road goes to NAME_road.xdmf.
    path : Path, optional
    save : Path, optional
        NAME.npz for the step with the most nodes in contact, as a problem of its own; of linear schemes.
    """
    body, X, outer = scheme.body, scheme.body.coordinates, scheme.body.contact_nodes
    begin = most = scheme.start(velocity=np.tile([10.0, 0.0], (len(X), 1)))
    history, states = History(scheme, begin), []
    radius, angle, outline = [mean_radius(body, begin.displacement)], [0.0], X[outer]
    for state in integrate(scheme, begin, 130, history):
        radius.append(mean_radius(body, state.displacement))
        angle.append(turn(X[outer], (X + state.displacement)[outer]))
        most = state if state.count > most.count else most
        states.append(state)
        if state.step == 90:
            outline = (X + state.displacement)[outer]
    if path:
        write_motion(path, elasticity, body, "outer", states)
    if save:
        save_step(save, scheme, most)
    return Turned(history, np.array(radius), np.unwrap(angle), outline)


def note_turning(scene: Scene, at: str, run: Turned) -> None:
    """Note when a ring touches again, how far it turns and swells, what becomes of its energy and its momentum."""
    touch, rotation, energy = MARKS.get(at, (None, None, None))
    other, history = "an independent program, same mesh and dt" if at in MARKS else None, run.history
    end = sum(history[part][-1] for part in ("kinetic", "strain", "potential"))
    gain = history["gain"].max() / history["kinetic"][0]
    scene.result(f"second_touch[{at}]", history.bounces(apart=0.05)[1][0], "s", touch, other)
    scene.result(f"rotation[{at}]", run.angle[90], "rad at 0.9 s", rotation, other)
    scene.result(f"energy_at_the_end[{at}]", end, "J/m at 1.3 s", energy, other)
    scene.result(f"energy_change[{at}]", end - history["total"][0], "J/m by 1.3 s")
    scene.result(f"mean_radius_change[{at}]", run.radius[90] / 0.5 - 1.0, "1, at 0.9 s", 0.0)
    scene.result(f"max_energy_gain[{at}]", gain, "of the initial energy", 0.0)
    scene.result(f"momentum_error[{at}]", history["momentum_error"].max(), "N s/m", 0.0)


def note_paper_rings(scene: Scene, run: "Runs", mus: tuple[float, ...]) -> dict[str, Turned]:
    """Launch the paper's ring of linear and of finite strain with each coefficient; return the runs by name.

    Files are written with mu = 0.1: of finite strain the series of fields, of linear strain a step.
    """
    files = {
        "finite, mu=0.1": {"path": scene.out / "ring.xdmf"},
        "linear, mu=0.1": {"save": scene.out / "problem.npz"},
    }
    turns = {}
    for mu in mus:
        for kind in ("linear", "finite"):
            at = f"{kind}, mu={mu:g}"
            turns[at] = turned(*paper_ring(mu, kind == "finite"), **files.get(at, {}))
            note_turning(scene, at, turns[at])
            if kind == "finite":
                run.add(turns[at].history)
    return turns


def inertia(scheme: Any, radius: float = 0.5) -> tuple[float, float]:
    """Mass, and I / (m R^2), of the ring as the scheme has it."""
    x = scheme.body.coordinates - scheme.body.coordinates.mean(axis=0)
    mass = float((scheme.M @ np.tile([1.0, 0.0], len(x))).sum())
    return mass, float(x.ravel() @ (scheme.M @ x.ravel())) / (mass * radius**2)


def speed_of(scheme: Any, state: Any, mass: float) -> float:
    """Speed of the centre of mass along the road (m/s)."""
    return float((scheme.M @ state.velocity.ravel())[0::2].sum() / mass)


def spin_of(scheme: Any, state: Any) -> float:
    """Angular momentum about the centre of mass."""
    x = scheme.body.coordinates + state.displacement
    p = (scheme.M @ state.velocity.ravel()).reshape(x.shape)
    mass = (scheme.M @ np.tile([1.0, 0.0], len(x))).reshape(x.shape)[:, 0]
    arm = x - mass @ x / mass.sum()
    return float(arm[:, 0] @ p[:, 1] - arm[:, 1] @ p[:, 0])


class Runs:
    """Runs of rings without driving, and what they are judged by together.

    Attributes
    ----------
    gains : list of float
        Largest gain of energy in a step of each run, of its largest kinetic energy.
    spins : list of float
        Changes of the angular momentum in a step in flight, over itself, but at least a hundredth of m R v.
    iterations : list of int
        Of Newton's method, each step.
    """

    def __init__(self, scene: Scene):
        self.scene, self.gains, self.spins, self.iterations = scene, [], [], []

    def __call__(self, scheme: Any, state: Any, steps: int, look: Callable | None = None) -> History:
        """Take so many steps, call look(before, state, positions at rest) after each; return the history."""
        history, X, (mass, _) = History(scheme, state), scheme.body.coordinates, inertia(scheme)
        for _ in self.scene.progress(range(steps)):
            before, state = state, scheme.step(state)
            history.record(before, state)
            self.iterations.append(scheme.iterations)
            if look is not None:
                look(before, state, X)
            if not before.count and not state.count:
                was = spin_of(scheme, before)
                least = 0.01 * mass * 0.5 * abs(speed_of(scheme, before, mass))
                self.spins.append((spin_of(scheme, state) - was) / max(abs(was), least))
        self.add(history)
        return history

    def add(self, history: History) -> None:
        """Count the energy of another run in."""
        self.gains.append(history["gain"].max() / history["kinetic"].max())

    def note(self) -> None:
        """Write down what the runs have in common."""
        self.scene.result("newton_iterations_median", np.median(self.iterations), "a step, all runs")
        of = "of the kinetic energy, worst step of all runs"
        self.scene.result("max_energy_gain", max(self.gains), of, 1e-10, "wanted at most")
        of = "of the angular momentum, a step in flight"
        self.scene.result("spin_error", np.abs(self.spins).max(), of, 1e-11, "wanted at most")


class Descent(NamedTuple):
    """A ring let go on an incline.

    Attributes
    ----------
    acceleration, slip : float
        Rates of the speed of the centre, and of that by which the lowest point slips (m/s^2).
    closed : float
        The former, of a rigid ring of its inertia that rolls, or slides where it cannot.
    sliding : float
        Least coefficient of friction with which that ring rolls.
    how : str
        The closed form.
    """

    acceleration: float
    slip: float
    closed: float
    sliding: float
    how: str


def let_go(runs: Runs, mu: float, around: int, dt: float, degrees: float = 10.0, end: float = 0.4) -> Descent:
    """Let a ring of E = 1e5 go from its sag on an incline; rates from 0.1 s to the end."""
    slope = np.radians(degrees)
    pull = GRAVITY * np.sin(slope), -GRAVITY * np.cos(slope)
    scheme = EnergyMomentum(wheel(1e5, mu, (around, 6), weight=pull), dt)
    mass, k = inertia(scheme)
    seen: list[tuple[float, float, float]] = []

    def look(before: Any, state: Any, X: np.ndarray) -> None:
        speed = speed_of(scheme, state, mass)
        seen.append((state.time, speed, speed + spin_of(scheme, state) / (k * mass * 0.5)))

    runs(scheme, scheme.start(sagged(scheme.body, -pull[1])), round(end / dt), look)
    times, speeds, slips = np.array(seen)[np.array(seen)[:, 0] > 0.1].T
    least = float(np.tan(slope) / (1 + 1 / k))
    closed, how = pull[0] / (1 + k), "g sin / (1 + I / (m R^2))"
    if mu <= least:
        closed, how = pull[0] + mu * pull[1], "g (sin - mu cos)"
    rates = (float(np.polyfit(times, each, 1)[0]) for each in (speeds, slips))
    return Descent(*rates, closed, least, how)


def note_threshold(scene: Scene, first: Descent, second: Descent, mus: tuple[float, float]) -> None:
    """Note at which coefficient the line through the slips at two others is 0."""
    found = mus[1] + (mus[1] - mus[0]) * second.slip / (first.slip - second.slip)
    scene.result("incline_threshold", found, "mu", first.sliding, "tan(theta) / (1 + m R^2 / I)")


def step_seconds(scheme: Any, steps: int = 60) -> float:
    """Median of the processor's seconds of a step in contact, of a ring that lands at 45 degrees."""
    state = scheme.start(velocity=np.tile([1.0, -1.0], (len(scheme.body.coordinates), 1)))
    spent = []
    for _ in range(steps):
        began = process_time()
        state = scheme.step(state)
        if state.count:
            spent.append(process_time() - began)
    return float(np.median(spent[2:]))


def note_cost(scene: Scene, mesh: tuple[int, int] = (96, 6), key: str = "cost_ratio_to_linear_step") -> None:
    """Note what a step costs over one of linear strain with the same mesh and dt."""
    moving = wheel(1000.0, 0.1, mesh)
    linear = Elasticity(moving.elastic.body, Isotropic(1000.0, 0.3))
    weight = linear.body_force((0.0, -GRAVITY))
    beside = MovingBody.from_forms(linear, 1.0, weight, Plane(), "outer", friction=0.1)
    ratio = step_seconds(EnergyMomentum(moving, 0.0025)) / step_seconds(MassRedistribution(beside, 0.0025))
    scene.result(key, ratio, "1, in contact", 10.0, "wanted at most")


def note_rolling(scene: Scene, scheme: Any, mu: float, v0: float, end: float) -> dict[str, Any]:
    """Throw a ring along its road at v0 until `end`; note when it rolls, and return (time, speed) by name.

    The closed form is that of a rigid ring: sliding_to_rolling_time = v0 / (mu g (1 + m R^2 / I)).
    """
    mass, k = inertia(scheme)
    begin = scheme.start(sagged(scheme.body), np.tile([v0, 0.0], (len(scheme.body.coordinates), 1)))
    ride = [
        (state.time, speed_of(scheme, state, mass))
        for state in integrate(scheme, begin, round(end / scheme.dt))
    ]
    times, speeds = np.array([(0.0, v0), *ride]).T
    wanted, rolling = v0 / (mu * GRAVITY * (1.0 + 1.0 / k)), v0 / (1.0 + k)
    slides = (times > 0.13 * wanted) & (times < 0.8 * wanted)
    slope, first = np.polyfit(times[slides], speeds[slides], 1)
    rolls = speeds[times > 1.04 * wanted].mean()
    scene.result(
        "sliding_to_rolling_time", (rolls - first) / slope, "s", wanted, "v0 / (mu g (1 + m R^2 / I))"
    )
    scene.result("rolling_speed", rolls, "m/s", rolling, "v0 / (1 + I / (m R^2))")
    closed = np.where(times < wanted, v0 - mu * GRAVITY * times, rolling)
    return {"computed": (times, speeds), "closed form (b)": (times, closed)}


def rolls(scheme: Any, revolutions: float, speed: float = 2.0) -> History:
    """Roll a ring from its sag at a speed (m/s), and return the history."""
    u = sagged(scheme.body)
    round_ = treadmill(scheme.body, u)
    spin = speed / np.linalg.norm(round_[np.argmin(scheme.body.coordinates[:, 1])])
    begin = scheme.start(u, [speed, 0.0] - spin * round_)
    history = History(scheme, begin)
    for _ in integrate(scheme, begin, round(2 * np.pi * revolutions / spin / scheme.dt), history):
        pass
    return history


def treadmill(moving: FiniteBody, u: np.ndarray) -> np.ndarray:
    """Change of the positions (N, 2) as the material goes round through a shape that stays, per radian."""
    X = moving.coordinates
    arm = X - [0.0, 0.5 * (X[:, 1].min() + X[:, 1].max())]
    angle, radius = np.arctan2(arm[:, 1], arm[:, 0]), np.linalg.norm(arm, axis=1)
    change = np.zeros_like(X)
    for r in np.unique(radius.round(9)):
        layer = np.flatnonzero(np.abs(radius - r) < 1e-8)
        layer = layer[np.argsort(angle[layer])]
        waves = np.fft.fftfreq(layer.size, 1 / layer.size)
        waves[layer.size // 2] = 0.0
        spectrum = 1j * waves[:, None] * np.fft.fft((X + u)[layer], axis=0)
        change[layer] = np.fft.ifft(spectrum, axis=0).real
    return change


def note_incline(scene: Scene, run: Runs) -> None:
    """Note how rings roll and slide down 10 degrees, and the friction between: rates of slip are linear in it."""
    around, dt = (96, 0.004) if scene.quick else (192, 0.002)
    down = {mu: let_go(run, mu, around, dt) for mu in (0.5, 0.05, 0.06)}
    for mu, rolled in down.items():
        key = "incline_acceleration" + f"[mu={mu:g}]" * (mu != 0.5)
        scene.result(key, rolled.acceleration, "m/s^2", rolled.closed, rolled.how)
    note_threshold(scene, down[0.05], down[0.06], (0.05, 0.06))


def note_thrown(scene: Scene, run: Runs) -> None:
    """Note the speed (m/s) at which a ring thrown at 10 m/s without spin from half a metre ends.

    It falls for 0.32 s and slides for about v0 / (mu g (1 + m R^2 / I)) = 3.74 s, so rolls from 3.9 s on.
    """
    E, mu, dt, end = (1e4, 0.5, 0.005, 1.5) if scene.quick else (1e6, 0.1, 0.001, 4.5)
    scheme, speeds = LosslessContact(wheel(E, mu, height=0.5), dt), []
    mass, k = inertia(scheme)
    thrown = scheme.start(velocity=np.tile([10.0, 0.0], (len(scheme.body.coordinates), 1)))
    run(
        scheme, thrown, round(end / dt), lambda before, state, X: speeds.append(speed_of(scheme, state, mass))
    )
    unit, how = f"m/s at {end:g} s, E = {E:g}, mu = {mu:g}", "v0 / (1 + I / (m R^2)), of a rigid ring"
    scene.result("final_speed[paper ring]", np.mean(speeds[-round(0.5 / dt) :]), unit, 10.0 / (1.0 + k), how)


def note_losses(scene: Scene, run: Runs) -> None:
    """Note what part of the energy a rolling ring loses to touching down, with both steps, and to friction."""
    for method in (EnergyMomentum, LosslessContact):
        history = rolls(method(wheel(1000.0, 0.5), 0.01), 0.2 if scene.quick else 1.0)
        run.add(history)
        key, how = f"rolling_energy_loss[{method.name}]", "frictionless contact does no work"
        scene.result(key, lost(history), "of the energy", 0.0, how)
    dt, revolutions = (0.01, 0.2) if scene.quick else (0.0025, 3.0)
    history = rolls(LosslessContact(wheel(1000.0, 0.5), dt), revolutions)
    run.add(history)
    of = f"of the energy, {revolutions:g} revolutions, dt = {dt:g} s, friction apart"
    scene.result("rolling_energy_loss", lost(history), of, 0.001, "wanted at most")
    friction = (history["friction"][-1] - history["friction"][0]) / history["kinetic"][0]
    scene.result("rolling_friction", friction, "of the energy, in the same run")


def lost(history: History) -> float:
    """What part of the first kinetic energy is gone at the end, friction apart."""
    return (history["total"][0] - history["total"][-1]) / history["kinetic"][0]
