"""Planted fault: the factor 2 of B left out."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "sphere/fault_half_b",
    covers=("HIT-1",),
    kind="fault",
    says="mixes B and B/2 in the sphere's quadratic",
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
    space="object",
)
def fault_half_b(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the roots of another quadratic."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)

    discriminant = B * B - 4 * A * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    t = interval.smallest((-B - root) / (2 * A), (-B + root) / (2 * A))
    return dr.select(discriminant >= 0, t, dr.inf)
