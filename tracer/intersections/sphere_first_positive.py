"""Control for erratum E3: "if t0 is positive, then we're done. If not, then compute t1"."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "sphere/first_positive",
    covers=("HIT-1",),
    kind="control",
    says="takes the sphere's second root without asking whether it is positive",
    stage=Stage.OBJECT,
    erratum="E3",
    space="object",
)
def first_positive(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return t0 if positive, else t1 whatever it is: a sphere behind the eye is hit, and clipping is ignored."""
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    discriminant = B * B - 4 * A * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    t0, t1 = (-B - root) / (2 * A), (-B + root) / (2 * A)
    return dr.select(discriminant >= 0, dr.select(t0 > 0, t0, t1), dr.inf)
