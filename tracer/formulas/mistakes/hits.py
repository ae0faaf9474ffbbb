"""Planted mistakes of the interval that near and far leave, and of the ray in object space."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from rayproof.tracer.rays import Ray
from rayproof.tracer.shapes.shape import Transform


def fault_far_ignored(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the near plane's t [m] and inf.

    Nothing is ever too far away.
    """
    return near / dr.dot(direction, forward), type(near)(dr.inf)


def fault_far_off(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the t [m] of the near plane, and of one at 1 - 1e-6 of the far plane's depth.

    The far plane a millionth too near.
    """
    per_depth = 1 / dr.dot(direction, forward)
    return near * per_depth, far * (1 - 1e-6) * per_depth


def fault_near_ignored(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return 0 and the far plane's t [m].

    Everything in front of the eye counts, up to the far plane.
    """
    return type(near)(0), far / dr.dot(direction, forward)


def fault_behind(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return -inf and inf.

    Negative t accepted: shapes behind the eye are seen.
    """
    return type(near)(-dr.inf), type(near)(dr.inf)


def fault_planes(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the t [m] of the frustum's planes.

    Planes where the scene asks for a shell.
    """
    cosine = dr.dot(direction, forward)
    return near / cosine, far / cosine


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
