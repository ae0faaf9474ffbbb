"""Ray and sphere by the quadratic formula as the lecture prints it, with the right choice of the root."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register("sphere/textbook", covers=("HIT-1",), kind="right", stage=Stage.OBJECT, space="object")
def textbook(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest of (-B -+ sqrt(B^2 - 4 A C)) / 2 A inside the interval, or inf."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    discriminant = B * B - 4 * A * C
    real = discriminant >= 0
    root = dr.sqrt(dr.select(real, discriminant, 0))
    t = interval.smallest((-B - root) / (2 * A), (-B + root) / (2 * A))
    return dr.select(real, t, dr.inf)
