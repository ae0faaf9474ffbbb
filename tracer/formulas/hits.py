"""Formulas from ray to hit: the interval that near and far leave, the ray in object space, the nearest hit, its point.

The scene's `clip` chooses the slot of the part that counts (specification, HIT-2); the others are of XF-1, XF-2 and
HIT-9.
"""

from collections.abc import Callable
from typing import Any

import drjit as dr

from rayproof.tracer.rays import Ray
from rayproof.tracer.shapes.shape import Transform


def planes(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the t [m] of the two planes: near < t dot(d, F) < far.

    Clipping by the frustum's near and far planes.
    """
    cosine = dr.dot(direction, forward)
    per_depth = 1 / cosine
    return near * per_depth, far * per_depth


def shell(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return near and far [m] themselves, a spherical shell around the eye.

    Control for erratum E2: near_clip < t < far_clip for the frustum's planes.
    """
    return near, far


def distance(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return near and far [m]: near < t < far.

    The lecture's clipping by distance, where the scene asks for it.
    """
    return near, far


def in_front(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return 0 and inf [m].

    No clipping: everything in front of the eye counts.
    """
    return type(near)(0), type(near)(dr.inf)


def to_object(ray: Ray, transform: Transform) -> Ray:
    """Return the ray by the inverse model matrix; the direction is not renormalised, so t keeps its meaning.

    A ray into object space.
    """
    return Ray(origin=transform.point_to_object(ray.origin), direction=transform.vector_to_object(ray.direction))


def along_ray(ray: Ray, distance: Any, object_ray: Callable[[], Any]) -> Any:
    """Return R0 + t Rd [m]; t means the same in both spaces, so no matrix is needed.

    The hit point in world space, taken along the world ray.
    """
    return ray.at(distance)


def by_matrix(ray: Ray, distance: Any, object_ray: Callable[[], Any]) -> Any:
    """Return the model matrix times the object-space hit point [m].

    The hit point in world space, taken from object space by the model matrix.
    """
    local, to_world = object_ray()
    return to_world(local.at(distance))


def reprojected(ray: Ray, distance: Any, object_ray: Any) -> Any:
    """Return c + (p - c) r / abs(p - c) for spheres, taken to world space, and R0 + t Rd for other shapes [m].

    The hit point in world space; on a sphere, moved along its radius onto the sphere.
    The remaining error of t moves the point along the surface. Points of other shapes are computed on the world ray.
    Source: Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th ed. (2023), section 6.8.5.
    """
    spheres, center, radius = object_ray.spheres()
    local, to_world = object_ray()
    outward = local.at(distance) - center
    on_sphere = dr.fma(outward, radius / dr.norm(outward), center)
    return dr.select(spheres, to_world(on_sphere), ray.at(distance))


def smaller(distance: Any, best: Any) -> Any:
    """Return the mask of `distance` smaller than `best`; at a tie the earlier shape stays the nearest."""
    return distance < best
