"""Ray and sphere: the quadratic, arranged so that nothing large cancels.

Source: Haines, Günther and Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems
(2019), chapter 7: the discriminant after Hearn and Baker, the roots after Press et al. and Blinn.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.numerics.quadratic import ordered
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "sphere/haines", covers=("HIT-1",), kind="right", stage=Stage.OBJECT, default=True, space="object"
)
def haines(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest t inside the interval at which the ray meets the sphere, or inf."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    h = -dr.dot(f, ray.direction)
    # The ray's closest point to the centre; comparing it with the radius loses (distance / radius)^2 fewer digits
    # than B^2 - 4 A C does.
    inverse_A = 1 / A
    closest = dr.fma(ray.direction, h * inverse_A, f)
    quarter_discriminant = A * (dr.square(sphere.radius) - dr.squared_norm(closest))
    # Without real roots, or with q = 0, a root is NaN or infinite, or 0: none of these lies inside an interval.
    q = h + dr.copysign(dr.sqrt(quarter_discriminant), h)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    return interval.smallest(*ordered(C / q, q * inverse_A))
