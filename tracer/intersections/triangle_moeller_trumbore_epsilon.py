"""Ray and triangle by Cramer's rule with an absolute epsilon, as it is often copied: a control.

The determinant is an area, so that a fixed epsilon deletes triangles by their size: at 1e-8 every one below about
0.1 mm, and larger ones that are slender or seen at a glance.
Source: the epsilon of the first program in Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection",
Journal of Graphics Tools 2 (1997).
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray

EPSILON = 1e-8  # m^2


@INTERSECTIONS.register(
    "triangle/moeller_trumbore_epsilon",
    covers=("HIT-6",),
    kind="control",
    stage=Stage.OBJECT,
    known_bad="an absolute epsilon on the determinant, an area, deletes small and slender triangles",
    leaks="two triangles round the edge that they share differently",
    space="world",
)
def moeller_trumbore_epsilon(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t as Möller and Trumbore do, but call every determinant below 1e-8 m^2 parallel."""
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    DxE2, TxE1 = dr.cross(D, E2), dr.cross(T, E1)
    determinant = dr.dot(DxE2, E1)
    parallel = abs(determinant) < EPSILON
    scale = 1 / dr.select(parallel, 1, determinant)
    t = dr.dot(TxE1, E2) * scale
    u = dr.dot(DxE2, T) * scale
    v = dr.dot(TxE1, D) * scale
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
