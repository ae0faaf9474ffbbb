"""Control for erratum E5: unsigned areas whose ratios must add up to 1 exactly."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "triangle/unsigned_areas",
    covers=("HIT-5",),
    kind="control",
    says="asks whether a triangle's areas sum up to exactly 1, which rounding makes false",
    stage=Stage.OBJECT,
    erratum="E5",
    space="world",
)
def unsigned_areas(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of the plane's hit where S1 + S2 + S3 = 1, which rounding makes false almost everywhere."""
    P1, P2, P3 = triangle.first, triangle.second, triangle.third
    N = dr.cross(P2 - P1, P3 - P1)
    slope = dr.dot(N, ray.direction)
    t = dr.dot(N, P1 - ray.origin) / slope
    P = ray.at(t)
    S = dr.norm(N)
    S1 = dr.norm(dr.cross(P2 - P, P3 - P)) / S
    S2 = dr.norm(dr.cross(P3 - P, P1 - P)) / S
    S3 = dr.norm(dr.cross(P1 - P, P2 - P)) / S
    return dr.select(interval.contains(t) & (S1 + S2 + S3 == 1), t, dr.inf)
