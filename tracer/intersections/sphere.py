"""Ray and sphere: the quadratic, arranged so that nothing large cancels.

Sources: Haines, Günther and Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems
(2019), chapter 7, for the discriminant after Hearn and Baker; Blinn, "How to Solve a Quadratic Equation" (2005), for
the roots.
"""

from typing import Any

import drjit as dr

from cases.stages import Stage
from tracer.intersections import INTERSECTIONS
from tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "sphere/stable", covers=("HIT-1",), kind="right", stage=Stage.OBJECT, default=True, space="object"
)
def stable(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest t inside the interval at which the ray meets the sphere, or inf."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    h = -dr.dot(f, ray.direction)
    # The ray's closest point to the centre; comparing it with the radius loses (distance / radius)^2 fewer digits
    # than B^2 - 4 A C does.
    closest = dr.fma(ray.direction, h / A, f)
    quarter_discriminant = A * (dr.square(sphere.radius) - dr.squared_norm(closest))
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    # The root farther from zero never cancels; the product of the roots, C / A, gives the other one.
    q = h + dr.copysign(root, h)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    t0 = dr.select(q == 0, 0, C / q)
    t1 = q / A
    swap = t0 > t1
    t = interval.smallest(dr.select(swap, t1, t0), dr.select(swap, t0, t1))
    return dr.select(real, t, dr.inf)
