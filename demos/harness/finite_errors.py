"""What finite strain costs and how exact it is: errors against dt and run time, every correction in space."""

from time import process_time
from typing import Any

import numpy as np

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean
from geometry import Body, Plane, box
from harness.scene import Scene
from harness.wheels import GRAVITY, wheel
from model import EnergyMomentum, FiniteBody, LosslessContact, MassRedistribution, MovingBody
from model.figures.figures import convergence_figure

END = 0.3  # s: the ring has bounced
FINITE, LOSSLESS, LINEAR = (
    "finite, energy-momentum",
    "finite, lossless contact",
    "linear, mass redistribution",
)


def schemes(mesh: tuple[int, int], mu: float = 0.1) -> dict[str, Any]:
    """What makes an integrator from dt, by name: for the paper's ring on the road, of finite and linear strain."""
    moving = wheel(1000.0, mu, mesh)
    linear = Elasticity(moving.elastic.body, Isotropic(E=1000.0, nu=0.3))
    weight = linear.body_force((0.0, -GRAVITY))
    body = MovingBody.from_forms(linear, 1.0, weight, Plane(), "outer", friction=mu)
    return {
        FINITE: lambda dt: EnergyMomentum(moving, dt),
        LOSSLESS: lambda dt: LosslessContact(moving, dt),
        LINEAR: lambda dt: MassRedistribution(body, dt),
    }


def note_errors(scene: Scene) -> None:
    """Note errors of a bounce against dt and processor time, beside the linear model; draw them.

    A ring lands at 45 degrees with 4.2 m/s, slides, turns and leaves the road. The error at 0.3 s is the mean
    distance (root of the mean square) of its nodes from where the smallest step takes them; that of the linear
    model, however small its step, is what linear strain gets wrong.
    """
    mesh, dts = (
        ((24, 3), (0.02, 0.01, 0.005)) if scene.quick else ((48, 4), (0.02, 0.01, 0.005, 0.0025, 0.00125))
    )
    made = schemes(mesh)
    exact = {name: ridden(make(dts[-1] / 4), END)[0] for name, make in made.items() if name != LOSSLESS}
    exact[LOSSLESS] = exact[FINITE]
    errors: dict[str, list[float]] = {name: [] for name in made}
    seconds: dict[str, list[float]] = {name: [] for name in made}
    for name, make in made.items():
        for dt in dts:
            u, run = ridden(make(dt), END)
            errors[name].append(distance(u, exact[name]))
            seconds[name].append(run)
            scene.result(f"error[{name}, dt={dt:g}]", errors[name][-1], "m at 0.3 s", 0.0, "smallest dt")
            scene.result(f"seconds[{name}, dt={dt:g}]", run, "s of processor time")
    model = distance(exact[LINEAR], exact[FINITE])
    scene.result("error_of_the_linear_model", model, "m at 0.3 s", 0.0, "finite strain")
    level, ylabel = {"what linear strain gets wrong": model}, "error of the nodes' places (m)"
    found = {name: np.array(error) for name, error in errors.items()}
    spent = {name: np.array(run) for name, run in seconds.items()}
    scene.figure(convergence_figure(np.array(dts), found, "dt (s)", ylabel, floors=level), "error_over_dt")
    label = "processor time of the run (s)"
    figure = convergence_figure(spent, found, label, ylabel, floors=level)
    figure.axes[0].legend(loc="lower left", frameon=False, fontsize="small")
    scene.figure(figure, "error_over_run_time")


def ridden(scheme: Any, end: float) -> tuple[np.ndarray, float]:
    """Throw a ring at the road; return where its nodes are at the end, (N, 2), and the processor's seconds."""
    state = scheme.start(velocity=np.tile([3.0, -3.0], (len(scheme.body.coordinates), 1)))
    scheme.step(state)  # compiles
    began = process_time()
    state = scheme.run(state, round(end / scheme.dt))
    return state.displacement, process_time() - began


def distance(u: np.ndarray, v: np.ndarray) -> float:
    """Root of the mean square of the nodes' distances."""
    return float(np.sqrt(np.mean(np.sum((u - v) ** 2, axis=1))))


def note_corrections(scene: Scene) -> None:
    """Note what a step of a rubber block that spins on to a road in space costs with each correction.

    `none` is the paper's loop, node after node on the nonlinear forces: what the others are tested against.
    """
    for refinements in (1,) if scene.quick else (1, 2, 3):
        body = Body.from_grid(box(0.4, 0.4, 0.4, 2, 2, 2, corner=(0.0, 0.0, 0.001)), refinements=refinements)
        elastic = Hyperelasticity(body, NeoHookean(E=1e4, nu=0.4))
        X, load = body.coordinates, elastic.body_force((0, 0, -GRAVITY))
        spin, ends = np.cross([1.0, 2.0, 3.0], X - X.mean(axis=0)) + [1.0, 0.5, -3.0], {}
        for correction in ("none",) * (refinements == 1) + ("direct", "multigrid", "algebraic"):
            road = Plane((0, 0, 0), (0, 0, 1))
            moving = FiniteBody.from_forms(elastic, 1.0, load, road, "bottom", friction=0.4)
            scheme = EnergyMomentum(moving, 1e-3, correction=correction)
            state = scheme.step(scheme.start(velocity=spin))
            began, iterations = process_time(), 0
            for _ in range(2):
                state = scheme.step(state)
                iterations += scheme.iterations
            spent, key = 0.5 * (process_time() - began), f"{correction}, {X.size} unknowns"
            ends[correction] = state
            scene.result(f"step_seconds[{key}]", spent, "s of processor time")
            scene.result(f"iterations[{key}]", iterations / 2, "a step; of `none`, sweeps")
            first = next(iter(ends.values()))
            off = np.abs(state.displacement - first.displacement).max() / 0.4
            how = f"what {next(iter(ends))!r} finds"
            scene.result(f"off[{key}]", off, "of the body's size, after three steps", 0.0, how)
