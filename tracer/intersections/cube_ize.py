"""Ray and cube by slabs with a far end that is moved away, so that no box is missed by rounding: a control.

Made for culling, where a false hit costs nothing. As an answer it hits what passes just outside.
Source: Ize, "Robust BVH Ray Traversal", Journal of Computer Graphics Techniques 2 (2013), with PBRT's 2 gamma(3).
"""

from typing import Any

import drjit as dr

from rayproof.cases.rounding import gamma
from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.rays import Interval, Ray


@INTERSECTIONS.register(
    "cube/ize",
    covers=("HIT-3",),
    kind="control",
    stage=Stage.OBJECT,
    known_bad="a conservative bound and no answer: ties outside the cube become hits, and 0 * inf is NaN",
    space="object",
)
def ize(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slabs' t with t_far times 1 + 2 gamma(3)."""
    precision = "float64" if dr.type_v(ray.direction) == dr.VarType.Float64 else "float32"
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        factor = 1 / direction
        t0, t1 = (-cube.half - origin) * factor, (cube.half - origin) * factor
        t_near = dr.maximum(t_near, dr.minimum(t0, t1))
        t_far = dr.minimum(t_far, dr.maximum(t0, t1))
    t_far = t_far * (1 + 2 * gamma(3, precision=precision))
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)
