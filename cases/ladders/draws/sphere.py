"""Rays at spheres."""

import numpy as np

from rayproof.cases.ladders.draws import across, directions, rounded
from rayproof.cases.ladders.ladder import Inputs


def _towards(
    count: int,
    generator: np.random.Generator,
    precision: str,
    *,
    distance: np.ndarray | float,
    impact: np.ndarray,
    radius: float = 1.0,
    offset: float = 0.0,
    speed: float = 1.0,
) -> Inputs:
    """Return rays that pass a sphere's centre at `impact` radii, from `distance` m; the sphere within `offset` m."""
    center = offset * directions(count, generator)
    away = directions(count, generator)
    origin = center + away * np.reshape(distance, (-1, 1))
    side = across(away, generator)
    foot = center + side * (impact * radius)[:, None]
    direction = foot - origin
    direction = speed * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    return {
        "o": rounded(origin, precision),
        "d": rounded(direction, precision),
        "c": rounded(center, precision),
        "r": rounded(np.full(count, radius), precision),
    }


def far(ratio: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return a unit sphere seen from `ratio` radii, impact 0 to 1.2 radii."""
    impact = generator.uniform(0, 1.2, count)
    return _towards(count, generator, precision, distance=1 + ratio, impact=impact)


def far_small(ratio: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return a sphere of radius 1 / ratio seen from 10 m, impact 0 to 1.2 radii."""
    impact = generator.uniform(0, 1.2, count)
    return _towards(count, generator, precision, distance=10.0, impact=impact, radius=1 / ratio)


def tangent(margin: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that pass within `margin` radii of the outline, inside or outside it."""
    side = np.where(generator.random(count) < 0.5, -1.0, 1.0)
    distance = 5.0
    # The impact parameter of a ray aimed at a point `p` from the centre, at a right angle to the way, is smaller.
    impact = 1 - side * margin
    aimed = impact / np.sqrt(1 - (impact / distance) ** 2)
    return _towards(count, generator, precision, distance=distance, impact=aimed)


def near(height: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays downwards from `height` radii above a unit sphere."""
    away = directions(count, generator)
    slope = np.sqrt(generator.uniform(0.05, 1.0, count))[:, None]
    direction = -slope * away + np.sqrt(1 - slope**2) * across(away, generator)
    return {
        "o": rounded(away * (1 + height), precision),
        "d": rounded(direction, precision),
        "c": np.zeros((count, 3)),
        "r": np.ones(count),
    }


def inside(depth: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays in all directions from `depth` radii below a unit sphere's surface."""
    return {
        "o": rounded(directions(count, generator) * (1 - depth), precision),
        "d": rounded(directions(count, generator), precision),
        "c": np.zeros((count, 3)),
        "r": np.ones(count),
    }


def perpendicular(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays with f . d = 0 exactly, f of `distance` radii along an axis, with zeros of both signs."""
    axis = generator.integers(3, size=count)
    zero = np.where(generator.random((count, 3)) < 0.5, -0.0, 0.0)
    o, d = zero.copy(), np.where(generator.random((count, 3)) < 0.5, -0.0, 0.0)
    rows = np.arange(count)
    o[rows, axis] = np.where(generator.random(count) < 0.5, -distance, distance)
    flat = generator.normal(size=(count, 2))
    flat = rounded(flat / np.linalg.norm(flat, axis=1, keepdims=True), precision)
    d[rows, (axis + 1) % 3], d[rows, (axis + 2) % 3] = flat.T
    return {"o": o, "d": d, "c": np.zeros((count, 3)), "r": np.ones(count)}


def translated(offset: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return a unit sphere and an eye 2 radii away, both moved by `offset` radii."""
    impact = generator.uniform(0, 0.9, count)
    return _towards(count, generator, precision, distance=2.0, impact=impact, offset=offset)


def scaled(scale: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return a sphere of radius `scale` m seen from 2 radii by unit directions."""
    drawn = _towards(count, generator, precision, distance=2.0, impact=generator.uniform(0, 0.9, count))
    return drawn | {name: rounded(drawn[name] * scale, precision) for name in ("o", "c", "r")}


def fast(speed: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return a unit sphere seen from 2 radii by directions of length `speed`."""
    return _towards(count, generator, precision, distance=2.0, impact=generator.uniform(0, 0.9, count), speed=speed)


def behind(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that leave a unit sphere at `distance` radii behind them: every one misses."""
    drawn = _towards(count, generator, precision, distance=1 + distance, impact=generator.uniform(0, 0.9, count))
    return drawn | {"d": -drawn["d"]}
