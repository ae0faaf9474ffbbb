"""Rays into object space, and hit points back to world space."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from rayproof.tracer.rays import Ray
from rayproof.tracer.shapes.shape import Transform


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
    What is left of t's error lies along the surface. Other shapes are hit along the world ray.
    Source: Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th ed. (2023), section 6.8.5.
    """
    spheres, center, radius = object_ray.spheres()
    local, to_world = object_ray()
    outward = local.at(distance) - center
    on_sphere = dr.fma(outward, radius / dr.norm(outward), center)
    return dr.select(spheres, to_world(on_sphere), ray.at(distance))
