"""Planted faults of the transforms formulas, for the audit; never in use unless named."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.rays import Ray
from rayproof.tracer.shapes.transforms import Transform
from rayproof.tracer.transforms import TRANSFORMS


@TRANSFORMS.register(
    "position/fault_left_in_object_space",
    covers=("XF-2",),
    kind="fault",
    says="leaves hit points in object space",
    stage=Stage.POSITION,
)
def fault_left_in_object_space(ray: Ray, distance: Any, object_ray: Callable[[], Any]) -> Any:
    """Return the object-space hit point [m].

    The hit point left in object space.
    """
    local, _ = object_ray()
    return local.at(distance)


@TRANSFORMS.register(
    "to_object/fault_forward_matrix",
    covers=("XF-1",),
    kind="fault",
    says="brings rays into object space by the model matrix instead of its inverse",
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
)
def fault_forward_matrix(ray: Ray, transform: Transform) -> Ray:
    """Return the ray taken the wrong way.

    The model matrix where its inverse belongs.
    """
    return Ray(origin=transform.point_to_world(ray.origin), direction=transform.vector_to_world(ray.direction))


@TRANSFORMS.register(
    "to_object/fault_moved_direction",
    covers=("XF-1",),
    kind="fault",
    says="moves a ray's direction like a point when it goes into object space",
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
)
def fault_moved_direction(ray: Ray, transform: Transform) -> Ray:
    """Return the object-space ray with a direction that was moved.

    The direction transformed as a point, translation and all.
    """
    return Ray(origin=transform.point_to_object(ray.origin), direction=transform.point_to_object(ray.direction))


@TRANSFORMS.register(
    "to_object/fault_renormalised",
    covers=("XF-1",),
    kind="fault",
    says="normalises the ray's direction in object space and takes t as it is",
    stage=Stage.DISTANCE,
    also=(Stage.OBJECT,),
)
def fault_renormalised(ray: Ray, transform: Transform) -> Ray:
    """Return the object-space ray with a unit direction.

    The direction renormalised in object space, so that t means something else there.
    """
    direction = transform.vector_to_object(ray.direction)
    return Ray(origin=transform.point_to_object(ray.origin), direction=dr.normalize(direction))
