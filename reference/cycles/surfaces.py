"""The specification's shapes as what Cycles gets right: spheres as points of a cloud, everything else as triangles.

A point under a matrix that is no similarity is another shape, so there are no ellipsoids; all is in world space.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle, is_similarity

BITS = np.array([[(index >> axis) & 1 for axis in range(3)] for index in range(8)]) - 0.5
# The faces of a cube and of a square by corners, counter-clockwise seen from outside.
CUBE = BITS[np.array(((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)))]
SQUARE = BITS[np.array([[0, 1, 3, 2]])] * (1, 1, 0)
# Where on its first side a square is parted, towards the corners opposite. A feeler that starts exactly on the seam of
# two triangles is blocked by one of them in Cycles, and a diagonal is where symmetrical scenes have pixels.
PARTED = (3 - 5**0.5) / 2
TRIANGLES = ((0, 4, 3), (4, 2, 3), (4, 1, 2))  # of a square's four corners and the point between the first two


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A sphere in world space."""

    center: np.ndarray  # (3,) m
    radius: float  # m


@dataclass(frozen=True, kw_only=True)
class Facets:
    """Triangles wound outward, each with the number of its face."""

    corners: np.ndarray  # (n, 3, 3) m
    numbers: np.ndarray  # (n,)


def surface_of(shape: Shape) -> Ball | Facets | str:
    """Return the shape in world space, or why Cycles has none like it, for a sentence about the shape.

    Raises:
        LookupError: an unknown kind of shape.

    """
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).astype(np.float64)
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        kept = np.flatnonzero(np.any(sides != 0, axis=1))
        return Facets(corners=corners[kept], numbers=kept)
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    linear, offset = matrix[:3, :3], matrix[:3, 3]
    if isinstance(shape, Plane):
        return "is an infinite plane"
    if isinstance(shape, Sphere):
        if not is_similarity(shape.to_world):
            return "is an ellipsoid"
        scale = float(np.cbrt(abs(np.linalg.det(linear))))
        return Ball(center=linear @ shape.center + offset, radius=shape.radius * scale)
    if not isinstance(shape, Cube | Square):
        raise LookupError(f"Cycles has not been taught the shape {type(shape).__name__}")
    faces = CUBE if isinstance(shape, Cube) else SQUARE
    between = faces[:, :1] + PARTED * (faces[:, 1:2] - faces[:, :1])
    corners = (np.concatenate([faces, between], axis=1) @ linear.T + offset)[:, TRIANGLES].reshape(-1, 3, 3)
    if np.linalg.det(linear) < 0:
        corners = corners[:, [0, 2, 1]]
    return Facets(corners=corners, numbers=np.zeros(len(corners), dtype=int))
