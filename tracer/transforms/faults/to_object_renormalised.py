"""Planted fault: the direction renormalised in object space, so that t means something else there."""

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.placement import Placement
from rayproof.tracer.rays import Ray
from rayproof.tracer.transforms import TRANSFORMS


@TRANSFORMS.register(
    "to_object/fault_renormalised",
    covers=("XF-1",),
    kind="fault",
    says="normalises the ray's direction in object space and takes t as it is",
    stage=Stage.DISTANCE,
    also=(Stage.OBJECT,),
)
def fault_renormalised(ray: Ray, placement: Placement) -> Ray:
    """Return the object-space ray with a unit direction."""
    direction = placement.vector_to_object(ray.direction)
    return Ray(origin=placement.point_to_object(ray.origin), direction=dr.normalize(direction))
