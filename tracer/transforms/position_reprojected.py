"""The hit point in world space; on a sphere, moved along its radius onto the sphere.

What is left of t's error lies along the surface. Other shapes are hit along the world ray.
Source: Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th ed. (2023), section 6.8.5.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.rays import Ray
from rayproof.tracer.transforms import TRANSFORMS


@TRANSFORMS.register("position/reprojected", covers=("XF-2",), kind="right", stage=Stage.POSITION)
def reprojected(ray: Ray, distance: Any, object_ray: Any) -> Any:
    """Return c + (p - c) r / abs(p - c) for spheres, taken to world space, and R0 + t Rd for other shapes [m]."""
    spheres, center, radius = object_ray.spheres()
    local, to_world = object_ray()
    outward = local.at(distance) - center
    on_sphere = dr.fma(outward, radius / dr.norm(outward), center)
    return dr.select(spheres, to_world(on_sphere), ray.at(distance))
