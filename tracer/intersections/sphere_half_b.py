"""Ray and sphere by the quadratic formula with half of B, which cancels every 2 and 4.

Source: Shirley, "Ray Tracing in One Weekend" (2016 and later), section on simplifying the intersection code.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register("sphere/half_b", covers=("HIT-1",), kind="right", stage=Stage.OBJECT, space="object")
def half_b(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest of (h -+ sqrt(h^2 - A C)) / A with h = -B / 2 inside the interval, or inf."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    h = -dr.dot(f, ray.direction)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    quarter_discriminant = h * h - A * C
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    return dr.select(real, interval.smallest((h - root) / A, (h + root) / A), dr.inf)
