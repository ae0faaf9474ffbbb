"""A ball around each bounded shape: rays that pass it by, as float64 sees with room to spare, cannot meet the shape."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Plane, Shape, Sphere, Square
from rayproof.reference.double_double.constants import Rational
from rayproof.reference.double_double.pair_arithmetic import Bool, Float
from rayproof.reference.double_double.surfaces import Span
from rayproof.reference.double_double.vectors import Vector

# Of the sum of all lengths involved: two dozen roundings of 2^-53 are less than a hundredth of it, and what is ruled
# out is so far off that, were it asked in pairs, what rules it out would have a margin far above 2^-80.
ROOM = 2.0**-40
TINY = 1e-280  # squares below it lose digits


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A ball as seen from an apex, with room."""

    to_center: tuple[Float, Float, Float]  # [m]
    radius_square: Float  # [m^2]

    def may_be_met(self, ray: Vector, span: Span) -> Bool:
        """Return where a ray comes near, ahead of the apex and before the end of a feeler; where unsure, true."""
        x, y, z = (part.high for part in ray)
        a, b, c = self.to_center
        square = x * x + y * y + z * z
        nearest = (x * a + y * b + z * c) * (1 / square)
        nearest = dr.select(nearest < 0, 0, nearest)
        if span.is_feeler:
            nearest = dr.select(nearest > 1, 1, nearest)
        p, q, r = a - nearest * x, b - nearest * y, c - nearest * z
        # Not "is nearer", so that NaN rules out nothing.
        return ~(p * p + q * q + r * r > self.radius_square) | (square < TINY)


def ball_of(shape: Shape, apex: Rational, types: Any) -> Ball | None:
    """Return the ball around a shape, None around a plane."""
    if isinstance(shape, Plane):
        return None
    center, radius, sizes = _around(shape)
    eye = np.array([float(value) for value in apex])
    reach = radius + ROOM * (sizes + float(np.linalg.norm(eye)))
    x, y, z = (dr.opaque(types.Float64, value) for value in (center - eye).tolist())
    return Ball(to_center=(x, y, z), radius_square=dr.opaque(types.Float64, reach * reach))


@lru_cache(maxsize=256)
def _around(shape: Shape) -> tuple[np.ndarray, float, float]:
    """Return centre and radius, and the sum of the lengths that they were computed from [m]."""
    place = np.array(shape.to_world, dtype=np.float64)
    matrix, offset = place[:3, :3], place[:3, 3]
    stretch = float(np.linalg.norm(matrix, ord=2))
    if isinstance(shape, Sphere):
        center, radius = matrix @ np.array(shape.center) + offset, shape.radius * stretch
        return center, radius, stretch * float(np.linalg.norm(shape.center)) + float(np.linalg.norm(offset)) + radius
    if isinstance(shape, Cube | Square):
        height = 0.5 if isinstance(shape, Cube) else 0.0
        corners = np.stack(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-height, height]), axis=-1).reshape(-1, 3)
        points = corners @ matrix.T + offset
    else:
        points = np.asarray(world_triangles(shape), dtype=np.float64).reshape(-1, 3)
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.linalg.norm(points - center, axis=1).max())
    return center, radius, float(np.linalg.norm(offset)) + float(np.linalg.norm(center)) + radius
