"""Planted fault: the square's full size taken for half of it."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "square/fault_full_size_local", covers=("HIT-7",), kind="fault", stage=Stage.OBJECT, space="object"
)
def fault_full_size_local(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return the t of a square of twice the size."""
    parallel = ray.direction.z == 0
    t = -ray.origin.z / dr.select(parallel, 1, ray.direction.z)
    P = ray.at(t)
    inside = (abs(P.x) < 2 * square.half) & (abs(P.y) < 2 * square.half)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
