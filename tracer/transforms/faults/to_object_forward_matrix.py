"""Planted fault: the model matrix where its inverse belongs."""

from rayproof.cases.stages import Stage
from rayproof.tracer.placement import Placement
from rayproof.tracer.rays import Ray
from rayproof.tracer.transforms import TRANSFORMS


@TRANSFORMS.register(
    "to_object/fault_forward_matrix",
    covers=("XF-1",),
    kind="fault",
    says="brings rays into object space by the model matrix instead of its inverse",
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
)
def fault_forward_matrix(ray: Ray, placement: Placement) -> Ray:
    """Return the ray taken the wrong way."""
    return Ray(origin=placement.point_to_world(ray.origin), direction=placement.vector_to_world(ray.direction))
