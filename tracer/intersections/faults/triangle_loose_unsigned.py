"""Planted fault: unsigned areas whose sum may exceed the whole by a thousandth (erratum E5, patched)."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "triangle/fault_loose_unsigned",
    covers=("HIT-5",),
    kind="fault",
    says="compares the triangle's areas with a tolerance of a thousandth, so that it is too large",
    stage=Stage.OBJECT,
    space="world",
)
def fault_loose_unsigned(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of a triangle that is a little too large."""
    P1, P2, P3 = triangle.first, triangle.second, triangle.third
    N = dr.cross(P2 - P1, P3 - P1)
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = dr.dot(N, P1 - ray.origin) / dr.select(parallel, 1, slope)
    P = ray.at(t)
    S1, S2, S3 = (dr.norm(dr.cross(a - P, b - P)) for a, b in ((P2, P3), (P3, P1), (P1, P2)))
    inside = dr.norm(N) * (1 + 1e-3) >= S1 + S2 + S3
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
