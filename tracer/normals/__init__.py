"""Normals: in object space, taken to world space, turned towards the viewer.

Contract, with the facts listed in `tracer.camera`:

    sphere_normal(point, center)         -> unit outward normal in object space
    cube_normal(point)                   -> likewise, for [-0.5, 0.5]^3; with the fact takes="ray" it gets the ray in
                                            object space and the distance instead
    world_normal(normal, transform)      -> unit world normal; not called where object space is world space
    facing(normal, direction)            -> the normal of a two-sided surface, turned against `direction`
"""

from collections.abc import Callable
from typing import Any

from rayproof.cases.declarations import DeclaredRegistry

NORMALS: DeclaredRegistry[Callable[..., Any]] = DeclaredRegistry(
    "normal formula", package="rayproof.tracer.normals", name="NORMALS"
)
