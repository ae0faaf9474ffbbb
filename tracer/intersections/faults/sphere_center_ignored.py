"""Planted fault: the centre left at the origin."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "sphere/fault_center_ignored",
    covers=("HIT-1",),
    kind="fault",
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
    space="object",
)
def fault_center_ignored(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the t of a sphere around the origin."""
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, ray.origin)
    C = dr.squared_norm(ray.origin) - dr.square(sphere.radius)
    discriminant = B * B - 4 * A * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    t = interval.smallest((-B - root) / (2 * A), (-B + root) / (2 * A))
    return dr.select(discriminant >= 0, t, dr.inf)
