"""Control for erratum E16: "the length of a vector <A, B, C>" for -(A x C) . B, a determinant and no length."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


def _triple(A: Any, B: Any, C: Any) -> Any:
    """Return -(A x C) . B, the determinant of the matrix with columns A, B, C."""
    return -dr.dot(dr.cross(A, C), B)


@INTERSECTIONS.register(
    "triangle/scalar_triple",
    covers=("HIT-6",),
    kind="control",
    stage=Stage.OBJECT,
    erratum="E16",
    equivalent="a word is wrong and the formula right: -(A x C) . B is the determinant that Cramer's rule asks for",
    leaks="two triangles round the edge that they share differently",
    space="world",
)
def scalar_triple(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t of the solution of E1 u + E2 v - D t = T, every unknown a quotient of two determinants."""
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    determinant = _triple(-D, E1, E2)
    parallel = determinant == 0
    scale = 1 / dr.select(parallel, 1, determinant)
    t, u, v = (_triple(*columns) * scale for columns in ((T, E1, E2), (-D, T, E2), (-D, E1, T)))
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
