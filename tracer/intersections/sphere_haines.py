"""Ray and sphere: the quadratic, arranged so that nothing large cancels.

Source: Haines, Günther and Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems
(2019), chapter 7: the discriminant after Hearn and Baker, the roots after Press et al. and Blinn.
"""

from typing import Any

import drjit as dr

from cases.stages import Stage
from tracer.intersections import INTERSECTIONS
from tracer.quadratic import stable_roots
from tracer.rays import Interval, Ray


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
    closest = dr.fma(ray.direction, h / A, f)
    quarter_discriminant = A * (dr.square(sphere.radius) - dr.squared_norm(closest))
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    return dr.select(real, interval.smallest(*stable_roots(A, h, C, root)), dr.inf)
