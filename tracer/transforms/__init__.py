"""Transforms: rays into object space, hit points back to world space.

Contract, with the facts listed in `tracer.camera`; a `transform` is `tracer.shapes.transforms.Transform`:

    to_object(ray, transform)           -> the ray in object space with the same parameter t
    position(ray, distance, object_ray) -> world point [m]; object_ray() gives the ray in the object space of the shape
                                           that was hit and a function that takes such a point to world space (itself
                                           a function, so that nothing is computed where it is not used);
                                           object_ray.spheres() gives where a sphere was hit, its centre and radius [m]
"""

from collections.abc import Callable
from typing import Any

from rayproof.cases.declarations import DeclaredRegistry

TRANSFORMS: DeclaredRegistry[Callable[..., Any]] = DeclaredRegistry(
    "transform", package="rayproof.tracer.transforms", name="TRANSFORMS"
)
