"""The specification's shapes as what Tachyon has: spheres, planes and triangles, in world space.

Tachyon takes no matrices. So a sphere must stay one, cubes are twelve triangles and squares two.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle

# Outward triangles of the cube and the square by their corners' bits of x, y, z (0: -0.5, 1: +0.5).
CORNERS = np.array([[(index >> axis) & 1 for axis in range(3)] for index in range(8)]) - 0.5
CUBE = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A sphere in world space."""

    center: np.ndarray  # (3,) m
    radius: float  # m


@dataclass(frozen=True, kw_only=True)
class Level:
    """An infinite plane."""

    point: np.ndarray  # (3,) m
    normal: np.ndarray  # (3,) unit


@dataclass(frozen=True, kw_only=True)
class Facets:
    """Triangles, each with the number of its face; their winding is outward."""

    corners: np.ndarray  # (n, 3, 3) m
    numbers: np.ndarray  # (n,)


Surface = Ball | Level | Facets


def surface_of(shape: Shape) -> Surface:
    """Return the shape in world space.

    Raises:
        LookupError: an unknown kind of shape.

    """
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).astype(np.float64)
        kept = np.flatnonzero(_area(corners) & _area(_object_corners(shape)))
        return Facets(corners=corners[kept], numbers=kept)
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    linear, offset = matrix[:3, :3], matrix[:3, 3]
    if isinstance(shape, Sphere):
        scale = np.cbrt(abs(np.linalg.det(linear)))
        return Ball(center=linear @ shape.center + offset, radius=float(shape.radius * scale))
    if isinstance(shape, Plane):
        normal = np.linalg.inv(linear)[2]
        return Level(point=offset, normal=normal / np.linalg.norm(normal))
    if isinstance(shape, Cube):
        faces = CORNERS[np.array(CUBE)]
    elif isinstance(shape, Square):
        faces = np.array([[[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]]])
    else:
        raise LookupError(f"Tachyon has not been taught the shape {type(shape).__name__}")
    corners = (faces @ linear.T + offset)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
    if np.linalg.det(linear) < 0:
        corners = corners[:, [0, 2, 1]]
    return Facets(corners=corners, numbers=np.zeros(len(corners), dtype=int))


def _object_corners(shape: Triangle | Mesh) -> np.ndarray:
    if isinstance(shape, Triangle):
        return np.asarray(shape.vertices, dtype=np.float64)[np.newaxis]
    return shape.vertices.astype(np.float64)[shape.faces]


def _area(corners: np.ndarray) -> np.ndarray:
    """Return which triangles have an area."""
    return np.any(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) != 0, axis=1)
