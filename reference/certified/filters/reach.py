"""How far along many rays each face of a shape is hit, as certain bounds; one row per ray, one column per face."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle
from rayproof.reference.certified.filters.margins import Margin, floats, of, products
from rayproof.reference.certified.placements import placement_of, rational, winding_of
from rayproof.reference.certified.vectors import Rational, cross, dot, minus


@dataclass(frozen=True, kw_only=True)
class Reach:
    """No hit that counts lies below `low` (inf: surely none); one surely counts at or below `high` (inf: maybe none).

    NaN in `low` is no bound.
    """

    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Span:
    """Hits count where low < t < high; both ends (rays, 1) with margins, None: no upper end."""

    low: Margin
    high: Margin | None

    def surely_out(self, t_low: np.ndarray, t_high: np.ndarray) -> np.ndarray:
        """Return where a t between these bounds surely does not count, (rays, faces)."""
        out = t_high <= self.low.low
        return out if self.high is None else out | (t_low >= self.high.high)

    def surely_in(self, t_low: np.ndarray, t_high: np.ndarray) -> np.ndarray:
        """Return where a t between these bounds surely counts, (rays, faces)."""
        inside = t_low > self.low.high
        return inside if self.high is None else inside & (t_high < self.high.low)


def reach(shape: Shape, apex: Rational, rays: Margin, span: Span) -> Reach:
    """Return the bounds for each face of a shape, seen from an exact apex along rays (N, 3)."""
    if isinstance(shape, Sphere):
        return _sphere(shape, apex, rays, span)
    if isinstance(shape, Cube):
        return _cube(shape, apex, rays, span)
    if isinstance(shape, Plane | Square):
        return _flat(shape, apex, rays, span)
    if isinstance(shape, Triangle | Mesh):
        return _triangles(shape, apex, rays, span)
    raise TypeError(f"certified knows no shape {type(shape).__name__}")


def _local(shape: Shape, apex: Rational, rays: Margin) -> tuple[Rational, Margin]:
    place = placement_of(shape)
    flat = of([value for row in place.inverse for value in row])
    matrix = Margin(flat.middle.reshape(3, 3), flat.radius.reshape(3, 3))
    return place.local(apex), products(rays, matrix)


def _sphere(shape: Sphere, apex: Rational, rays: Margin, span: Span) -> Reach:
    exact_start, along = _local(shape, apex, rays)
    start = of(exact_start)
    power = of([dot(exact_start, exact_start) - 1])
    x, y, z = (along[:, axis, np.newaxis] for axis in range(3))
    square = x * x + y * y + z * z
    half = x * start[0:1] + y * start[1:2] + z * start[2:3]
    discriminant = half * half - square * power
    root = discriminant.sqrt()
    low, high = np.full(square.middle.shape, np.inf), np.full(square.middle.shape, np.inf)
    nothing = floats(np.zeros(1))
    sure = discriminant.above()
    # From the larger root to the smaller: the smaller one overrides where it counts.
    for t in ((root - half) / square, (nothing - half - root) / square):
        low = np.where(span.surely_out(t.low, t.high), low, t.low)
        high = np.where(span.surely_in(t.low, t.high) & sure, t.high, high)
    return Reach(low=np.where(discriminant.below(), np.inf, low), high=high)


def _flat(shape: Shape, apex: Rational, rays: Margin, span: Span) -> Reach:
    exact_start, along = _local(shape, apex, rays)
    start = of(exact_start)
    x, y, z = (along[:, axis, np.newaxis] for axis in range(3))
    t = (floats(np.zeros(1)) - start[2:3]) / z
    out, sure = span.surely_out(t.low, t.high), span.surely_in(t.low, t.high)
    if isinstance(shape, Square):
        half = floats(np.array([0.5]))
        for coordinate in (start[0:1] + t * x, start[1:2] + t * y):
            beyond, short = coordinate - half, coordinate + half
            out |= beyond.above() | short.below()
            sure &= beyond.below() & short.above()
    return Reach(low=np.where(out, np.inf, t.low), high=np.where(sure, t.high, np.inf))


def _cube(shape: Cube, apex: Rational, rays: Margin, span: Span) -> Reach:
    exact_start, along = _local(shape, apex, rays)
    start = of(exact_start)
    count = along.middle.shape[0]
    first_low, first_high = np.full(count, -np.inf), np.full(count, -np.inf)
    last_low, last_high = np.full(count, np.inf), np.full(count, np.inf)
    for axis in range(3):
        speed = along[:, axis]
        known = speed.above() | speed.below()
        half = floats(np.where(speed.middle > 0, 0.5, -0.5))
        origin = start[axis : axis + 1]
        enter = (floats(np.zeros(1)) - half - origin) / speed
        leave = (half - origin) / speed
        # Nearly parallel: no bound either way.
        first_low = np.maximum(first_low, np.where(known, enter.low, -np.inf))
        first_high = np.maximum(first_high, np.where(known, enter.high, np.inf))
        last_low = np.minimum(last_low, np.where(known, leave.low, -np.inf))
        last_high = np.minimum(last_high, np.where(known, leave.high, np.inf))
    missed, sure = first_low > last_high, first_high < last_low
    low, high = np.full((count, 1), np.inf), np.full((count, 1), np.inf)
    for least, greatest in ((last_low, last_high), (first_low, first_high)):
        bounds = least[:, np.newaxis], greatest[:, np.newaxis]
        low = np.where(span.surely_out(*bounds), low, bounds[0])
        high = np.where(span.surely_in(*bounds) & sure[:, np.newaxis], bounds[1], high)
    return Reach(low=np.where(missed[:, np.newaxis], np.inf, low), high=high)


def _triangles(shape: Triangle | Mesh, apex: Rational, rays: Margin, span: Span) -> Reach:
    by_determinant, by_u, by_v, height, empty = _cramer(shape, apex)
    determinant, u, v = (products(rays, constants) for constants in (by_determinant, by_u, by_v))
    rest = determinant - u - v
    above = u.above() | v.above() | rest.above()
    below = u.below() | v.below() | rest.below()
    inside = (u.above() & v.above() & rest.above()) | (u.below() & v.below() & rest.below())
    with np.errstate(all="ignore"):
        t = height / determinant
    out = (above & below) | span.surely_out(t.low, t.high) | empty
    return Reach(
        low=np.where(out, np.inf, t.low), high=np.where(inside & span.surely_in(t.low, t.high) & ~empty, t.high, np.inf)
    )


@lru_cache(maxsize=64)
def _cramer(shape: Triangle | Mesh, apex: Rational) -> tuple[Margin, Margin, Margin, Margin, np.ndarray]:
    """Return what the determinant, u, v and t are made of, per face, and which faces surely or maybe have no area."""
    corners = world_triangles(shape).astype(np.float64)
    point = of(apex)
    first, second, third = (floats(corners[:, corner]) for corner in range(3))
    one, two = second - first, third - first
    to_apex = Margin(np.broadcast_to(point.middle, first.middle.shape), np.zeros_like(first.middle)) - first
    across = _cross(to_apex, one)
    height = across[:, 0] * two[:, 0] + across[:, 1] * two[:, 1] + across[:, 2] * two[:, 2]
    by_determinant = _cross(two, one)
    doubtful = ~(by_determinant.above() | by_determinant.below()).any(axis=1)
    empty = np.zeros(len(corners), dtype=bool)
    for face in np.flatnonzero(doubtful):
        a, b, c = (rational(corner) for corner in corners[face].tolist())
        empty[face] = not any(_exact_area(a, b, c))
    for face in np.flatnonzero(_flat_before(shape)):
        empty[face] |= not any(winding_of(shape, int(face)))
    return by_determinant, _cross(two, to_apex), across, height, empty


def _flat_before(shape: Triangle | Mesh) -> np.ndarray:
    vertices = np.asarray(shape.vertices, dtype=np.float64)
    corners = vertices[np.newaxis] if isinstance(shape, Triangle) else vertices[shape.faces]
    area = _cross(floats(corners[:, 1]) - floats(corners[:, 0]), floats(corners[:, 2]) - floats(corners[:, 0]))
    return np.asarray(~(area.above() | area.below()).any(axis=1))


def _exact_area(a: Rational, b: Rational, c: Rational) -> Any:
    return cross(minus(b, a), minus(c, a))


def _cross(left: Margin, right: Margin) -> Margin:
    columns = []
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        columns.append(left[:, i] * right[:, j] - left[:, j] * right[:, i])
    return Margin(
        np.stack([column.middle for column in columns], axis=1), np.stack([column.radius for column in columns], axis=1)
    )
