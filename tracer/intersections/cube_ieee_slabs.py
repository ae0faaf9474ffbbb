"""Ray and cube by slabs and IEEE infinities, without any branch: a control.

Sources: Smits, "Efficiency Issues for Ray Tracing", Journal of Graphics Tools 3 (1998); Williams, Barrus, Morley and
Shirley, "An Efficient and Robust Ray-Box Intersection Algorithm", Journal of Graphics Tools 10 (2005).
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/ieee_slabs",
    covers=("HIT-3",),
    kind="control",
    stage=Stage.OBJECT,
    known_bad="0 * inf is NaN where a parallel ray starts in a face's plane, which the closed cube contains",
    space="object",
)
def ieee_slabs(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slabs' t by minimum and maximum; a NaN in any of them is a miss."""
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        factor = 1 / direction
        t0, t1 = (-cube.half - origin) * factor, (cube.half - origin) * factor
        t_near = dr.maximum(t_near, dr.minimum(t0, t1))
        t_far = dr.minimum(t_far, dr.maximum(t0, t1))
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)
