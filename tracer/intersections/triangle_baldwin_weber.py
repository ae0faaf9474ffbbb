"""Ray and triangle by the matrix that takes the triangle to (0, 0), (1, 0), (0, 1) in the plane z = 0.

The matrix is made in float64 and rounded once, but the translation in it has the size of world coordinates: digits go
with the distance from the world's origin.
Source: Baldwin and Weber, "Fast Ray-Triangle Intersections by Coordinate Transformation", Journal of Computer Graphics
Techniques 5 (2016). They store the matrix with the triangle; here it is made anew from the corners, which is slower.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.numerics.float64 import in_float64
from rayproof.tracer.rays import Interval, Ray


def _rows(triangle: Any) -> tuple[tuple[Any, Any], ...]:
    """Return the matrix's three rows, each (3-vector, translation [m]), in float64."""
    first, second, third = (in_float64(corner) for corner in (triangle.first, triangle.second, triangle.third))
    E1, E2 = second - first, third - first
    N = dr.cross(E1, E2)
    size = abs(N)
    x_largest = (size.x >= size.y) & (size.x >= size.z)
    y_largest = ~x_largest & (size.y >= size.z)
    axis = type(N)(
        dr.select(x_largest, 1, 0), dr.select(y_largest, 1, 0), dr.select(x_largest | y_largest, 0, 1)
    )  # the coordinate that the first two rows leave out
    largest = dr.dot(N, axis)
    scale = dr.select(largest == 0, 0, 1 / dr.select(largest == 0, 1, largest))
    rows = (dr.cross(E2, axis) * scale, dr.cross(axis, E1) * scale, N * scale)
    return tuple((row, -dr.dot(row, first)) for row in rows)


@INTERSECTIONS.register(
    "triangle/baldwin_weber",
    covers=("HIT-6",),
    kind="right",
    stage=Stage.OBJECT,
    leaks="two triangles round the edge that they share differently",
    space="world",
)
def baldwin_weber(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t at which u >= 0, v >= 0 and u + v <= 1, if inside the interval, or inf."""
    Float, Vector = type(ray.direction.x), type(ray.direction)
    rows = [(Vector(row), Float(offset)) for row, offset in _rows(triangle)]
    origin = [dr.dot(row, ray.origin) + offset for row, offset in rows]
    direction = [dr.dot(row, ray.direction) for row, _ in rows]
    parallel = direction[2] == 0
    t = -origin[2] / dr.select(parallel, 1, direction[2])
    u, v = (dr.fma(d, t, o) for d, o in zip(direction[:2], origin[:2], strict=True))
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
