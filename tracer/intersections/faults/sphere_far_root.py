"""Planted fault: the far root taken."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "sphere/fault_far_root",
    covers=("HIT-1",),
    kind="fault",
    says="takes the larger root of the sphere's quadratic",
    stage=Stage.DISTANCE,
    also=(Stage.OBJECT,),
    space="object",
)
def fault_far_root(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the larger root, if inside the interval, or inf."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)

    discriminant = B * B - 4 * A * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    t = (-B + root) / (2 * A)
    return dr.select((discriminant >= 0) & interval.contains(t), t, dr.inf)
