"""Ray and square in its local space: the plane z = 0, then abs(x) < 0.5 and abs(y) < 0.5."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "square/local", covers=("HIT-7",), kind="right", stage=Stage.OBJECT, default=True, space="object"
)
def local(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return the t of the plane's hit if it lies in the square and inside the interval, or inf."""
    parallel = ray.direction.z == 0
    t = -ray.origin.z / dr.select(parallel, 1, ray.direction.z)
    P = ray.at(t)
    inside = (abs(P.x) < square.half) & (abs(P.y) < square.half)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
