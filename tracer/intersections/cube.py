"""Ray and cube by slabs.

Source: Kay and Kajiya, "Ray Tracing Complex Scenes" (1986), as the lecture tells it, with a parallel ray decided by
containment alone and the division skipped (erratum E15), and the interval deciding between entry and exit (E4).
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register("cube/slabs", covers=("HIT-3",), kind="right", stage=Stage.OBJECT, default=True, space="object")
def slabs(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the smaller of entry and exit t inside the interval, or inf."""
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        inside = abs(origin) <= cube.half
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        # A parallel ray inside the slab is never bounded by it; outside it meets nothing.
        enter = dr.select(parallel, dr.select(inside, -dr.inf, dr.inf), enter)
        leave = dr.select(parallel, dr.inf, leave)
        # These propagate a NaN; a choice by comparison would drop it and bound the ray by the other slabs alone.
        t_near = dr.maximum(t_near, enter)
        t_far = dr.minimum(t_far, leave)
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)
