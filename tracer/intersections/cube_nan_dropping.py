"""Ray and cube by slabs with minimum and maximum that drop a NaN: a control.

A dropped NaN does not say "inside this slab": what is left of the pair is an infinity, and that misses.
Source: Barnes, "Fast, Branchless Ray/Bounding Box Intersections, Part 2: NaNs" (2015).
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/nan_dropping",
    covers=("HIT-3",),
    kind="control",
    stage=Stage.OBJECT,
    known_bad="of a slab whose plane holds a parallel ray's origin, one bound is NaN and the other an infinity that "
    "misses",
    space="object",
)
def nan_dropping(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slabs' t by fmin and fmax, which return the other operand of a NaN."""
    t_near: Any = -dr.inf
    t_far: Any = dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        factor = 1 / direction
        t0, t1 = (-cube.half - origin) * factor, (cube.half - origin) * factor
        t_near = dr.fmax(t_near, dr.fmin(t0, t1))
        t_far = dr.fmin(t_far, dr.fmax(t0, t1))
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)
