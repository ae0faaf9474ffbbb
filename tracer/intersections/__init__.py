"""Intersections: the distance t at which a ray meets a primitive, inf where it does not.

Contract, with the facts listed in `tracer.camera` and space="object" or "world" (the space of the ray that a
primitive's formula wants; triangles are always in world space):

    sphere(ray, sphere, interval)      sphere.center, sphere.radius
    cube(ray, cube, interval)          cube.half = 0.5
    plane(ray, plane, interval)        the plane z = 0
    square(ray, square, interval)      square.center, .half_width, .half_height (world [m]), .orthogonal (bool);
                                       in object space half-size .half = 0.5 in z = 0
    triangle(ray, triangle, interval)  triangle.first, .second, .third
    nearest(distance, best)            -> where `distance` replaces `best`

The direction of a ray need not be a unit vector. Of a primitive's intersections the smallest inside `interval` counts.
A NaN is a miss; nothing else may turn a hit into a miss afterwards, so a formula answers for its own t.
"""

from collections.abc import Callable
from typing import Any

from rayproof.cases.declarations import DeclaredRegistry

INTERSECTIONS: DeclaredRegistry[Callable[..., Any]] = DeclaredRegistry(
    "intersection formula", package="rayproof.tracer.intersections", name="INTERSECTIONS"
)
