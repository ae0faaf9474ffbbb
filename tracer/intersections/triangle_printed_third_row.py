"""Control for erratum E6: the third component of Cramer's rule as printed, (D x E1) . D, which is always 0."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "triangle/printed_third_row",
    covers=("HIT-6",),
    kind="control",
    says="takes Cramer's rule as the lecture prints it, with a third row that is always 0",
    stage=Stage.OBJECT,
    erratum="E6",
    space="world",
)
def printed_third_row(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of a strip instead of a triangle: v never bounds it."""
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    DxE2 = dr.cross(D, E2)
    determinant = dr.dot(DxE2, E1)
    t = dr.dot(dr.cross(T, E1), E2) / determinant
    u = dr.dot(DxE2, T) / determinant
    v = dr.dot(dr.cross(D, E1), D) / determinant
    return dr.select(interval.contains(t) & (u >= 0) & (v >= 0) & (u + v <= 1), t, dr.inf)
