"""Planted fault: A taken as 1, right only for a direction that is a unit vector in object space."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "sphere/fault_unit_a",
    covers=("HIT-1",),
    kind="fault",
    says="takes A = 1 in the sphere's quadratic for a direction that is no unit vector",
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
    space="object",
)
def fault_unit_a(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the roots of t^2 + B t + C."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)

    discriminant = B * B - 4 * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    t = interval.smallest((-B - root) / 2, (-B + root) / 2)
    return dr.select((discriminant >= 0) & (A > 0), t, dr.inf)
