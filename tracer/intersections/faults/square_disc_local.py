"""Planted fault: a disc hit in place of the square."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "square/fault_disc_local",
    covers=("HIT-7",),
    kind="fault",
    says="takes a disc for a square",
    stage=Stage.OBJECT,
    space="object",
)
def fault_disc_local(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return the t of the square's inscribed disc."""
    parallel = ray.direction.z == 0
    t = -ray.origin.z / dr.select(parallel, 1, ray.direction.z)
    P = ray.at(t)
    inside = P.x * P.x + P.y * P.y < square.half * square.half
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
