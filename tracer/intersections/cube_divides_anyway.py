"""Control for erratum E15: the slab's parallel test is followed by the division."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/divides_anyway",
    covers=("HIT-3",),
    kind="control",
    stage=Stage.OBJECT,
    erratum="E15",
    equivalent="0 / 0 needs a ray in the plane of a face, which sees that face edge-on, as an outline, where hit "
    "and miss are both right; elsewhere x / 0 is an infinity of the right sign",
    space="object",
)
def divides_anyway(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slab test's t with 0 / 0 where a parallel ray runs inside a face's plane."""
    t_near, t_far = -dr.inf, dr.inf
    missed: Any = False
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        missed = missed | ((direction == 0) & (abs(origin) > cube.half))
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        t_near = dr.select(enter > t_near, enter, t_near)
        t_far = dr.select(leave < t_far, leave, t_far)
    return dr.select((t_near <= t_far) & ~missed, interval.smallest(t_near, t_far), dr.inf)
