"""Ray and sphere by the quadratic's usual discriminant and roots that do not cancel.

Sources: Blinn, "How to Solve a Quadratic Equation", IEEE Computer Graphics and Applications (2005 and 2006); Press et
al., "Numerical Recipes", section 5.6.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.numerics.quadratic import stable_roots
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register("sphere/stable_quadratic", covers=("HIT-1",), kind="right", stage=Stage.OBJECT, space="object")
def stable_quadratic(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest of q / A and C / q inside the interval, with q = h +- sqrt(h^2 - A C), or inf."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    h = -dr.dot(f, ray.direction)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    quarter_discriminant = h * h - A * C
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    return dr.select(real, interval.smallest(*stable_roots(A, h, C, root)), dr.inf)
