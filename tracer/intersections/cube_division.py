"""Ray and cube by slabs and IEEE infinities, divided instead of multiplied by a reciprocal: a control.

One rounding less than `cube/ieee_slabs`, which halves an outline's wrong pixels and leaves the NaN as it is.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/division",
    covers=("HIT-3",),
    kind="control",
    stage=Stage.OBJECT,
    known_bad="0 / 0 is NaN where a parallel ray starts in a face's plane, which the closed cube contains",
    space="object",
)
def division(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slabs' t by division, minimum and maximum; a NaN in any of them is a miss."""
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        t0, t1 = (-cube.half - origin) / direction, (cube.half - origin) / direction
        t_near = dr.maximum(t_near, dr.minimum(t0, t1))
        t_far = dr.minimum(t_far, dr.maximum(t0, t1))
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)
