"""Planted fault: the direction transformed as a point, translation and all."""

from rayproof.cases.stages import Stage
from rayproof.tracer.placement import Placement
from rayproof.tracer.rays import Ray
from rayproof.tracer.transforms import TRANSFORMS


@TRANSFORMS.register(
    "to_object/fault_moved_direction",
    covers=("XF-1",),
    kind="fault",
    says="moves a ray's direction like a point when it goes into object space",
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
)
def fault_moved_direction(ray: Ray, placement: Placement) -> Ray:
    """Return the object-space ray with a direction that was moved."""
    return Ray(origin=placement.point_to_object(ray.origin), direction=placement.point_to_object(ray.direction))
