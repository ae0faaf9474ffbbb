"""Planted fault: parallel decided by a fixed size of the determinant, whatever the triangle's size."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "triangle/fault_fixed_epsilon",
    covers=("HIT-6",),
    kind="fault",
    says="takes a small determinant for a ray parallel to the triangle, so that small triangles vanish",
    cases=("meshes/icosphere", "models/*"),
    stage=Stage.OBJECT,
    space="world",
)
def fault_fixed_epsilon(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t, or inf also where the determinant is small."""
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    DxE2, TxE1 = dr.cross(D, E2), dr.cross(T, E1)
    determinant = dr.dot(DxE2, E1)
    parallel = determinant == 0
    scale = 1 / dr.select(parallel, 1, determinant)
    t = dr.dot(TxE1, E2) * scale
    u = dr.dot(DxE2, T) * scale
    v = dr.dot(TxE1, D) * scale

    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return dr.select(interval.contains(t) & inside & ~parallel & (abs(determinant) > 1e-2), t, dr.inf)
