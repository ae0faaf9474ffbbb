"""Ray and triangle by barycentric areas with a sign, which decides without any equality (erratum E5)."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "triangle/signed_areas",
    covers=("HIT-5",),
    kind="right",
    stage=Stage.OBJECT,
    leaks="two triangles round the edge that they share differently",
    space="world",
)
def signed_areas(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of the plane's hit if S1, S2 and S3 lie in [0, 1] and t inside the interval, or inf."""
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    N = dr.cross(E1, E2)
    from_first = ray.origin - triangle.first
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = -dr.dot(N, from_first) / dr.select(parallel, 1, slope)
    P = dr.fma(ray.direction, t, from_first)  # relative to the first corner, so that far triangles lose no digits
    area = dr.squared_norm(N)
    S1 = dr.dot(N, dr.cross(E1 - P, E2 - P))
    S2 = dr.dot(N, dr.cross(P, E2))
    S3 = dr.dot(N, dr.cross(E1, P))
    # The three add up to `area`: none negative implies none above it.
    inside = (S1 >= 0) & (S2 >= 0) & (S3 >= 0) & (area > 0)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
