"""Planted fault: the smaller root taken even where it lies behind the eye."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "sphere/fault_negative_root",
    covers=("HIT-1",),
    kind="fault",
    says="takes the sphere's smaller root wherever it lies, behind the eye too",
    cases=("behind/sphere", "behind/all_lit"),
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
    space="object",
)
def fault_negative_root(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smaller root wherever it lies."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)

    discriminant = B * B - 4 * A * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    return dr.select(discriminant >= 0, (-B - root) / (2 * A), dr.inf)
