"""A cube's normal by the slab whose plane the ray met at its t, remembered instead of read off the hit point.

The hit point is off by roundings of the way it went, the slabs' t compare within roundings of each other.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.rays import Ray
from rayproof.tracer.shapes.shape import HALF


@NORMALS.register("cube_normal/entering_slab", covers=("NRM-2",), kind="right", stage=Stage.NORMAL, takes="ray")
def entering_slab(ray: Ray, distance: Any) -> Any:
    """Return the outward axis of the plane that is met nearest to `distance`; at a tie x before y before z."""
    nearest, axis, sign = None, None, None
    for index, (origin, direction) in enumerate(zip(ray.origin, ray.direction, strict=True)):
        parallel = direction == 0
        for face in (-HALF, HALF):
            t = (face - origin) / dr.select(parallel, 1, direction)
            off = dr.select(parallel, dr.inf, abs(t - distance))
            if nearest is None:
                nearest, axis, sign = off, dr.zeros(dr.uint32_array_t(type(off))), type(off)(face * 2)
                continue
            closer = off < nearest
            nearest = dr.select(closer, off, nearest)
            axis = dr.select(closer, index, axis)
            sign = dr.select(closer, face * 2, sign)
    return type(ray.direction)(*(dr.select(axis == index, sign, 0) for index in range(3)))
