"""Planted fault: back faces culled."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "triangle/fault_culled",
    covers=("HIT-6",),
    kind="fault",
    says="culls triangles that face away",
    stage=Stage.OBJECT,
    space="world",
)
def fault_culled(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t where the triangle faces the ray, or inf."""
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

    inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (determinant > 0)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
