"""Ray and sphere solved in float64, for rays and hits in the working precision.

Products of float32 numbers are exact in float64, so that only the discriminant's few sums are rounded at all.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.numerics.float64 import in_float64
from rayproof.tracer.numerics.quadratic import stable_roots
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register("sphere/float64", covers=("HIT-1",), kind="right", stage=Stage.OBJECT, space="object")
def float64(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest t inside the interval, rounded once to the working precision, or inf."""
    Float = type(ray.direction.x)
    direction, f = in_float64(ray.direction), in_float64(ray.origin) - in_float64(sphere.center)
    A = dr.squared_norm(direction)
    h = -dr.dot(f, direction)
    C = dr.squared_norm(f) - dr.square(in_float64(sphere.radius))
    quarter_discriminant = h * h - A * C
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    near, far = stable_roots(A, h, C, root)
    return dr.select(real, interval.smallest(Float(near), Float(far)), dr.inf)
