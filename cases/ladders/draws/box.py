"""Rays at the cube of half-size 0.5."""

import numpy as np

from rayproof.cases.ladders.draws import directions, rounded
from rayproof.cases.ladders.ladder import Inputs


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _orders(count: int, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return np.argsort(generator.random((count, 3)), axis=1), np.where(generator.random((count, 3)) < 0.5, -1.0, 1.0)


def _placed(o: np.ndarray, d: np.ndarray, generator: np.random.Generator, precision: str) -> Inputs:
    """Return the same rays seen from all sides of the cube."""
    order, sign = _orders(len(o), generator)
    return {
        "o": rounded(np.take_along_axis(o, order, axis=1) * sign, precision),
        "d": rounded(np.take_along_axis(d, order, axis=1) * sign, precision),
    }


def silhouette(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays at points of edges that bound the cube's outline, from `distance` m."""
    edge = np.stack([np.full(count, 0.5), np.full(count, 0.5), generator.uniform(-0.45, 0.45, count)], axis=1)
    # Seen from between the two faces' own half-spaces, one face is visible and the other not.
    away = np.stack(
        [generator.uniform(0.1, 1, count), -generator.uniform(0.1, 1, count), generator.normal(size=count) / 2], axis=1
    )
    origin = rounded(edge + _unit(away) * distance, precision)
    return _placed(origin, _unit(edge - origin), generator, precision)


def around(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays from `distance` m at points in a cube of half-size 0.7."""
    target = generator.uniform(-0.7, 0.7, (count, 3))
    origin = rounded(target + directions(count, generator) * distance, precision)
    return {"o": origin, "d": rounded(_unit(target - origin), precision)}


def in_face(kind: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays inside a face's plane with the component along its normal +0 (1) or -0 (2), aimed at the face."""
    o = np.stack([np.full(count, 0.5), np.full(count, -2.0), generator.uniform(-0.4, 0.4, count)], axis=1)
    d = np.stack([np.zeros(count), np.ones(count), generator.uniform(-0.05, 0.05, count)], axis=1)
    drawn = _placed(o, d, generator, precision)
    drawn["d"][drawn["d"] == 0] = 0.0 if kind == 1 else -0.0
    return drawn


def along_edge(kind: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays along an edge's line, with zeros +0 (1) or -0 (2), from outside (of either end) or from within it."""
    start = np.where(generator.random(count) < 0.5, -2.0, generator.uniform(-0.4, 0.4, count))
    o = np.stack([np.full(count, 0.5), np.full(count, 0.5), start], axis=1)
    d = np.tile([0.0, 0.0, 1.0], (count, 1))
    drawn = _placed(o, d, generator, precision)
    drawn["d"][drawn["d"] == 0] = 0.0 if kind == 1 else -0.0
    return drawn


def through_corner(steps: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays exactly through a corner, by sums of powers of two that no rounding touches: they touch or enter."""
    corner = np.full((count, 3), 0.5)
    d = generator.integers(1, 8, (count, 3)) / 8.0 * np.where(generator.random((count, 3)) < 0.5, -1.0, 1.0)
    return _placed(corner - d * steps, d, generator, precision)


def inside(depth: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays in all directions from `depth` m below a face; 0 is on the face itself."""
    o = np.concatenate([np.full((count, 1), 0.5 - depth), generator.uniform(-0.45, 0.45, (count, 2))], axis=1)
    return _placed(o, directions(count, generator), generator, precision)


def leaving(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that leave the cube behind them at `distance` m: every one misses."""
    drawn = around(2.0 + distance, count, generator, precision)
    return drawn | {"d": -drawn["d"]}


def nearly_parallel(slope: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays that cross the cube with one component of the direction about `slope`."""
    o = np.concatenate(
        [generator.uniform(-0.7, 0.7, (count, 1)), np.full((count, 1), -3.0), generator.uniform(-0.2, 0.2, (count, 1))],
        axis=1,
    )
    d = np.stack(
        [slope * generator.uniform(0.5, 1, count), np.ones(count), generator.uniform(-0.05, 0.05, count)], axis=1
    )
    return _placed(o, d, generator, precision)


def plate(thickness: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return, in its object space, rays at a plate of this thickness: one axis is stretched by 1 / thickness."""
    target = generator.uniform(-0.6, 0.6, (count, 3)) * [1, 1, thickness]
    away = directions(count, generator)
    away[:, 2] = np.sign(away[:, 2]) * (abs(away[:, 2]) + 0.1)
    origin = target + _unit(away) * 3
    stretch = np.array([1, 1, 1 / thickness])
    return {"o": rounded(origin * stretch, precision), "d": rounded((target - origin) / 3 * stretch, precision)}


def beside_edge(margin: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays from 5 m at a face, `margin` m from one of its edges."""
    return _beside(margin, 5.0, count, generator, precision)


def beside_edge_far(distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    """Return rays from `distance` m at a face, 1e-6 m (float64: 2e-15 m) from one of its edges."""
    return _beside(1e-6 if precision == "float32" else 2e-15, distance, count, generator, precision)


def _beside(margin: float, distance: float, count: int, generator: np.random.Generator, precision: str) -> Inputs:
    hit = np.stack(
        [np.full(count, 0.5), 0.5 - margin * generator.uniform(0.5, 1.5, count), generator.uniform(-0.45, 0.45, count)],
        axis=1,
    )
    away = _unit(np.stack([np.ones(count), *(abs(generator.normal(size=(2, count)))) * 0.6], axis=1))
    origin = rounded(hit + away * distance, precision)
    return _placed(origin, _unit(hit - origin), generator, precision)
