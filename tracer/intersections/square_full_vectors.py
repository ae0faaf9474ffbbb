"""Control for erratum E7: the two dot tests with full width and height vectors."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "square/full_vectors",
    covers=("HIT-8",),
    kind="control",
    says="takes a square's half vectors for its whole width and height, so that it is twice as large",
    stage=Stage.OBJECT,
    erratum="E7",
    space="world",
)
def full_vectors(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return the t of a square of twice the size, right only in its plane."""
    width, height = 2 * square.half_width, 2 * square.half_height
    N = dr.cross(width, height)
    from_center = ray.origin - square.center
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = -dr.dot(N, from_center) / dr.select(parallel, 1, slope)
    P = dr.fma(ray.direction, t, from_center)
    inside = (abs(dr.dot(P, width)) < dr.squared_norm(width)) & (abs(dr.dot(P, height)) < dr.squared_norm(height))
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
