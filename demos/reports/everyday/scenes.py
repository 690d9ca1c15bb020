"""Everyday scenes drawn at random: a body, its supports, its loads, a road, and a way to solve."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy.sparse import bsr_array, diags_array

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, Road, ShiftedRoad
from model import BodyOnRoad

from .bodies import PLANE, SHAPES, meshed
from .roads import CURVED, brought, extruded, plane

SUPPORTS = ("none", "one node along x", "pinned node", "clamped", "along x", "platen", "driven", "springs")
LOADS = ("weight", "face", "node", "moment", "weight and moment", "none")
CORRECTIONS = ("auto", "direct", "algebraic", "multigrid", "none")
MODERATE = (0.01, 0.05, 0.1, 0.2, 0.3, 0.5)  # coefficients of friction
STRONG = (0.7, 1.0, 1.5, 2.0)
SMALL_ENOUGH = 60  # nodes that the plain loop takes on


@dataclass
class Scene:
    """One scene, drawn by its number.

    Attributes
    ----------
    number : int
        Which draws the same scene always.
    words : dict
        What was drawn, by name.
    pressed : BodyOnRoad
    load : (N, d)
        Of the system, at its fullest.
    road : Road
    curved : bool
        Whether the road is not flat.
    """

    number: int
    words: dict[str, Any]
    pressed: BodyOnRoad
    load: np.ndarray
    road: Road
    curved: bool
    elasticity: Elasticity
    support: Support

    def __str__(self) -> str:
        """Say what was drawn."""
        return f"scene {self.number}: " + ", ".join(
            f"{name} {value:.3g}" if isinstance(value, float) else f"{name} {value}"
            for name, value in self.words.items()
        )


def drawn(number: int, **chosen: Any) -> Scene:
    """Draw a scene.

    Parameters
    ----------
    number : int
        The same number draws the same scene.
    **chosen
        Words to change after the draw, as `correction="direct"`.
    """
    random = np.random.default_rng(number)
    words = _words(random) | chosen
    seed = int(random.integers(2**32))
    return _built(number, words, np.random.default_rng(seed))


def _words(random: np.random.Generator) -> dict[str, Any]:
    """Draw what can be said in words and numbers."""

    def one_of(values: Any, weights: Any = None) -> Any:
        return values[int(random.choice(len(values), p=weights))]

    shape = one_of(list(PLANE)) if random.random() < 0.8 else one_of(list(SHAPES)[len(PLANE) :])
    road = "plane" if random.random() < 0.6 else one_of(list(CURVED))
    kind = one_of(("static", "load steps", "time step"), (0.6, 0.25, 0.15))
    if shape == "quarter ball" or kind == "time step":
        road = "plane"
    friction = one_of((None, 0.0, one_of(MODERATE), one_of(STRONG)), (0.4, 0.05, 0.35, 0.2))
    nested = SHAPES[shape].refinements > 0
    corrections = (0.35, 0.25, 0.2, 0.1, 0.1) if nested else (0.35, 0.3, 0.25, 0.0, 0.1)
    gap = 0.0 if random.random() < 0.4 else 10.0 ** random.uniform(-6.0, 1.0)
    return {
        "shape": shape,
        "size": one_of((1e-3, 1.0, 1.0, 10.0)),
        "E": one_of((1.0, 1e6, 210e3)),
        "nu": one_of((0.0, 0.3, 0.45)),
        "road": road,
        "friction": friction,
        "support": one_of(SUPPORTS, (0.3, 0.15, 0.1, 0.1, 0.1, 0.1, 0.05, 0.1)),
        "load": one_of(LOADS, (0.3, 0.3, 0.15, 0.1, 0.1, 0.05)),
        "strength": 10.0 ** random.uniform(-8.0, 3.0),
        "slant": 0.0
        if random.random() < 0.5
        else float(random.uniform(-1.0, 1.0))
        if random.random() < 0.8
        else float(random.uniform(-np.pi, np.pi)),
        "gap": gap,
        "kind": kind,
        "correction": one_of(CORRECTIONS, corrections),
    }


@cache
def elastic(shape: str, E: float, nu: float, size: float) -> tuple[Elasticity, bsr_array, bsr_array]:
    """Elasticity, stiffness and mass (density 1) of a shape drawn to a size."""
    elasticity = Elasticity(meshed(shape, size), Isotropic(E, nu))
    return elasticity, elasticity.stiffness(), elasticity.mass(1.0)


def _built(number: int, words: dict[str, Any], random: np.random.Generator) -> Scene:
    """Build what the words say."""
    shape, size = SHAPES[words["shape"]], words["size"]
    elasticity, K, _ = elastic(words["shape"], words["E"], words["nu"], size)
    body, _dim = elasticity.body, elasticity.body.dim
    names = (
        [shape.touching[0]] if words["road"] == "plane" and random.random() < 0.5 else list(shape.touching)
    )
    candidates = np.unique(np.concatenate([body.nodes(name) for name in names]))
    road = _road(words, body, candidates, random)
    support, K = _support(words, elasticity, K, random)
    load = _load(words, elasticity, random)
    system = support.apply(K, load)
    pressed = BodyOnRoad(system, names, road, friction=words["friction"])
    return Scene(number, words, pressed, load, road, words["road"] != "plane", elasticity, support)


def _road(words: dict[str, Any], body: Body, candidates: np.ndarray, random: np.random.Generator) -> Road:
    """The road, as far from the body as the words say."""
    size, dim = words["size"], body.dim
    points, gap = body.coordinates[candidates], words["gap"] * size
    if words["road"] == "plane":
        road = (
            Plane(np.zeros(dim), np.eye(dim)[-1])
            if SHAPES[words["shape"]].symmetric
            else plane(random, dim, size)
        )
        away = road.closest(points)[0].min() - gap
        return Plane(road.point + away * road.normal, road.normal)
    road = CURVED[words["road"]](random, size)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    aside = np.zeros(2)
    aside[0] = 0.0 if random.random() < 0.3 else random.uniform(-0.5, 0.5) * size
    if words["road"] in ("round hole", "two walls"):
        aside *= 0.1
    road = ShiftedRoad(road, [middle[0] + aside[0], 0.0])
    if dim == 3:
        road = extruded(road)
    way = np.zeros(dim)
    way[-1] = 1.0
    return brought(road, points, way, size, gap)


def _support(
    words: dict[str, Any], elasticity: Elasticity, K: bsr_array, random: np.random.Generator
) -> tuple[Support, bsr_array]:
    """The supports, and the stiffness with springs in it."""
    body, dim, size = elasticity.body, elasticity.body.dim, words["size"]
    shape = SHAPES[words["shape"]]
    held = body.nodes(shape.held)
    support, kind = Support(body), words["support"]
    middle = int(
        held[np.argmin(np.sum((body.coordinates[held] - body.coordinates[held].mean(axis=0)) ** 2, axis=1))]
    )
    level = {"x": 0.0} if dim == 2 else {"x": 0.0, "y": 0.0}
    upright = "xyz"[dim - 1]
    if shape.symmetric:
        support.fix("x0", x=0.0).fix("y0", y=0.0)
        if kind in ("one node along x", "pinned node", "clamped", "along x", "driven"):
            support.fix(shape.held, **{upright: 0.0}) if kind == "clamped" else None
        elif kind == "platen":
            kind = "none"
    elif kind == "driven" and words["kind"] == "time step":
        kind = "clamped"
    if shape.symmetric:
        pass
    elif kind == "one node along x":
        support.fix_node(middle, **level)
    elif kind == "pinned node":
        support.fix_node(middle, **(level | {upright: 0.0}))
    elif kind == "clamped":
        support.fix(shape.held, **(level | {upright: 0.0}))
    elif kind == "along x":
        support.fix(shape.held, **level)
    elif kind == "platen":
        support.platen(shape.held)
        if random.random() < 0.5:
            support.fix(shape.held, **level)
    if kind == "driven":
        way = words["size"] * (words["gap"] + 0.01 * min(words["strength"], 1.0))
        support.fix(shape.held, **(({} if shape.symmetric else level) | {upright: -way}))
    if kind == "springs":
        soft = words["E"] * size ** (dim - 2) * 10.0 ** random.uniform(-4.0, 0.0)
        springs = np.zeros((body.coordinates.shape[0], dim))
        springs[held] = soft / held.size
        K = bsr_array(K + diags_array(springs.ravel()), blocksize=(dim, dim))
    return support, K


def _load(words: dict[str, Any], elasticity: Elasticity, random: np.random.Generator) -> np.ndarray:
    """Nodal forces (nodes of the body, d).

    At strength 1 about the load that makes a contact a tenth of the size wide, by Hertz.
    """
    body, dim, size = elasticity.body, elasticity.body.dim, words["size"]
    shape, kind = SHAPES[words["shape"]], words["load"]
    P = words["strength"] * 0.008 * words["E"] * size ** (dim - 1)
    direction = np.zeros(dim)
    direction[-1], direction[0] = -np.cos(words["slant"]), np.sin(words["slant"])
    held = body.nodes(shape.held)
    load = np.zeros(body.coordinates.shape)
    if kind in ("weight", "weight and moment"):
        volume = elasticity.body_force((*np.zeros(dim - 1), 1.0)).sum()
        load += elasticity.body_force(P / volume * direction)
    if kind == "face":
        load += elasticity.total_force(shape.held, P * direction)
    if kind == "node":
        load[random.choice(held)] += P * direction
    if kind in ("moment", "weight and moment"):
        one, other = held[np.argmin(body.coordinates[held, 0])], held[np.argmax(body.coordinates[held, 0])]
        couple = P * random.uniform(-1.0, 1.0) * (0.3 if kind == "weight and moment" else 1.0)
        load[one, -1] += couple
        load[other, -1] -= couple
    return load
