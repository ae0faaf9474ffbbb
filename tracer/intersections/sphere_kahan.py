"""Ray and sphere with a discriminant that is rounded as if once: a difference of products by fused operations.

It repairs the rounding inside the discriminant, and not that of its coefficients.
Source: Kahan, "On the Cost of Floating-Point Computation Without Extra-Precise Arithmetic" (2004).
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.numerics.products import difference_of_products
from rayproof.tracer.numerics.quadratic import stable_roots
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register("sphere/kahan", covers=("HIT-1",), kind="right", stage=Stage.OBJECT, space="object")
def kahan(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest t inside the interval, with h h - A C rounded as if once, or inf."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    h = -dr.dot(f, ray.direction)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    quarter_discriminant = difference_of_products(h, h, A, C)
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    return dr.select(real, interval.smallest(*stable_roots(A, h, C, root)), dr.inf)
