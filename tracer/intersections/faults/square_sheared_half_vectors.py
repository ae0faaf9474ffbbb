"""Planted fault: the two dot tests used under shear, where width and height are not orthogonal (erratum E7)."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "square/fault_sheared_half_vectors",
    covers=("HIT-8",),
    kind="fault",
    says="tests squares by their half vectors as if these were always at right angles",
    stage=Stage.OBJECT,
    space="world",
)
def fault_sheared_half_vectors(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return t inside two strips that bound the square only without shear."""
    w, h = square.half_width, square.half_height
    N = dr.cross(w, h)
    from_center = ray.origin - square.center
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = -dr.dot(N, from_center) / dr.select(parallel, 1, slope)
    P = dr.fma(ray.direction, t, from_center)
    inside = (abs(dr.dot(P, w)) < dr.squared_norm(w)) & (abs(dr.dot(P, h)) < dr.squared_norm(h))
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
