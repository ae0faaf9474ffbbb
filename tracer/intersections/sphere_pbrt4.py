"""Ray and sphere as PBRT-4 does: the discriminant by the closest point's distance, as a product of sum and difference.

Source: Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th ed. (2023), section 6.8.3, and pbrt-v4's
shapes.h, Sphere::BasicIntersect.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.numerics.quadratic import stable_roots
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register("sphere/pbrt4", covers=("HIT-1",), kind="right", stage=Stage.OBJECT, space="object")
def pbrt4(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest t inside the interval, by D = A (r - abs(l)) (r + abs(l)), or inf."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    h = -dr.dot(f, ray.direction)
    closest = dr.norm(dr.fma(ray.direction, h / A, f))
    quarter_discriminant = A * (sphere.radius - closest) * (sphere.radius + closest)
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    return dr.select(real, interval.smallest(*stable_roots(A, h, C, root)), dr.inf)
