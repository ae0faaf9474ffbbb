"""Planted mistakes of `formulas/transforms`; a run that uses one says so, and none is used unless it is named."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from rayproof.tracer.rays import Ray
from rayproof.tracer.shapes.shape import Transform


def fault_left_in_object_space(ray: Ray, distance: Any, object_ray: Callable[[], Any]) -> Any:
    """Return the object-space hit point [m].

    The hit point left in object space.
    """
    local, _ = object_ray()
    return local.at(distance)


def fault_forward_matrix(ray: Ray, transform: Transform) -> Ray:
    """Return the ray taken the wrong way.

    The model matrix where its inverse belongs.
    """
    return Ray(origin=transform.point_to_world(ray.origin), direction=transform.vector_to_world(ray.direction))


def fault_moved_direction(ray: Ray, transform: Transform) -> Ray:
    """Return the object-space ray with a direction that was moved.

    The direction transformed as a point, translation and all.
    """
    return Ray(origin=transform.point_to_object(ray.origin), direction=transform.point_to_object(ray.direction))


def fault_renormalised(ray: Ray, transform: Transform) -> Ray:
    """Return the object-space ray with a unit direction.

    The direction renormalised in object space, so that t means something else there.
    """
    direction = transform.vector_to_object(ray.direction)
    return Ray(origin=transform.point_to_object(ray.origin), direction=dr.normalize(direction))
