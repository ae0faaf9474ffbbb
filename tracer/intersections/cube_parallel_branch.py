"""Ray and cube by slabs with a branch for parallel rays, and one reciprocal for both faces of a slab.

Source: Kay and Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986; the branch as in the lecture.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.numerics.quadratic import ordered
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register("cube/parallel_branch", covers=("HIT-3",), kind="right", stage=Stage.OBJECT, space="object")
def parallel_branch(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the smaller of entry and exit t inside the interval, or inf."""
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        inside = abs(origin) <= cube.half
        factor = 1 / direction
        enter, leave = ordered((-cube.half - origin) * factor, (cube.half - origin) * factor)
        enter = dr.select(parallel, dr.select(inside, -dr.inf, dr.inf), enter)
        leave = dr.select(parallel, dr.inf, leave)
        # These propagate a NaN; a choice by comparison would drop it and bound the ray by the other slabs alone.
        t_near = dr.maximum(t_near, enter)
        t_far = dr.minimum(t_far, leave)
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)
