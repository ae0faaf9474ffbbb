"""Ray and triangle by Cramer's rule, with the lecture's third row corrected (erratum E6).

Source: Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", Journal of Graphics Tools 2 (1997).
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "triangle/moeller_trumbore",
    covers=("HIT-6",),
    kind="right",
    stage=Stage.OBJECT,
    leaks="two triangles round the edge that they share differently",
    space="world",
)
def moeller_trumbore(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t at which u >= 0, v >= 0 and u + v <= 1, if inside the interval, or inf."""
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    DxE2, TxE1 = dr.cross(D, E2), dr.cross(T, E1)
    # The determinant has the unit of an area: only 0 itself means parallel, whatever the triangle's size.
    determinant = dr.dot(DxE2, E1)
    parallel = determinant == 0
    scale = 1 / dr.select(parallel, 1, determinant)
    t = dr.dot(TxE1, E2) * scale
    u = dr.dot(DxE2, T) * scale
    v = dr.dot(TxE1, D) * scale
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
