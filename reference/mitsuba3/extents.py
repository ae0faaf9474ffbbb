"""How large things are: axis-aligned boxes of finite shapes and distances from the eye, in float64."""

import itertools
import math
from functools import lru_cache

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle

CUBE_CORNERS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
SQUARE_CORNERS = CUBE_CORNERS[::2] * (1.0, 1.0, 0.0)


@lru_cache(maxsize=256)
def box(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest world coordinates [m] of a finite shape, (3,) each.

    Raises:
        TypeError: the shape is infinite.

    """
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).reshape(-1, 3).astype(np.float64)
        return corners.min(axis=0), corners.max(axis=0)
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    linear, translation = matrix[:3, :3], matrix[:3, 3]
    if isinstance(shape, Sphere):
        center = linear @ shape.center + translation
        # A linear map turns the unit ball into one that reaches as far along an axis as that row is long.
        reach = shape.radius * np.linalg.norm(linear, axis=1)
        return center - reach, center + reach
    if isinstance(shape, Cube | Square):
        corners = (CUBE_CORNERS if isinstance(shape, Cube) else SQUARE_CORNERS) @ linear.T + translation
        return corners.min(axis=0), corners.max(axis=0)
    raise TypeError(f"{type(shape).__name__} has no box")


def finite_shapes(scene: Scene) -> list[tuple[int, Shape]]:
    """Return the shapes that have a box, each with its index in the scene."""
    return [(index, shape) for index, shape in enumerate(scene.shapes) if not isinstance(shape, Plane)]


def distances_from(eye: tuple[float, float, float], shape: Shape) -> tuple[float, float]:
    """Return bounds [m] on how near and how far from `eye` the points of a finite shape lie."""
    low, high = box(shape)
    nearest = np.linalg.norm(np.maximum(0.0, np.maximum(low - eye, eye - high)))
    farthest = np.linalg.norm(np.maximum(np.abs(low - eye), np.abs(high - eye)))
    return float(nearest), float(farthest)


def farthest_visible(camera: Camera) -> float:
    """Return the distance [m] from the eye to the far plane's corners."""
    vertical = math.tan(camera.alpha)
    return camera.far * math.hypot(1.0, vertical, vertical * camera.aspect)
