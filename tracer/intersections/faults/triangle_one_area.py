"""Planted fault: only two of the three signed areas looked at."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "triangle/fault_one_area",
    covers=("HIT-5",),
    kind="fault",
    says="leaves out the third side of triangles",
    stage=Stage.OBJECT,
    space="world",
)
def fault_one_area(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of an angle without its third side."""
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    N = dr.cross(E1, E2)
    from_first = ray.origin - triangle.first
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = -dr.dot(N, from_first) / dr.select(parallel, 1, slope)
    P = dr.fma(ray.direction, t, from_first)
    inside = (dr.dot(N, dr.cross(P, E2)) >= 0) & (dr.dot(N, dr.cross(E1, P)) >= 0) & (dr.squared_norm(N) > 0)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
