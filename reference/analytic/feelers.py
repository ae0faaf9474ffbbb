"""Visibility of lights: the open segment from a hit point to a light meets nothing (LIT-1).

The surface that was hit is divided out by algebra, never by an epsilon: a flat face cannot block itself, an ellipsoid
or a cube does so exactly where the light's side says so. So there is no acne to suppress, and a point that lies a
rounding off its surface is treated as lying on it. A surface that coincides with the hit one is another surface, which
holds the point as well: the open segment does not meet it there.
"""

import numpy as np

from rayproof.cases.scene import Cube, Scene
from rayproof.reference.analytic.ellipsoids import Ellipsoid
from rayproof.reference.analytic.ends import ends_of
from rayproof.reference.analytic.polygons import Polygons
from rayproof.reference.analytic.surfaces import cube_points, surface_of
from rayproof.reference.analytic.vectors import dot


def visibility(scene: Scene, objects: np.ndarray, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return 1 per light above the horizon and unobstructed, else 0, shape (N, lights); 0 on a miss."""
    answer = np.zeros((len(objects), len(scene.lights)))
    for column, light in enumerate(scene.lights):
        source = np.asarray(light.position, dtype=np.float64)
        asked = np.flatnonzero((objects[:, 0] >= 0) & above_horizon(source, positions, normals))
        free = np.ones(len(asked), dtype=bool)
        for index in range(len(scene.shapes)):
            left = np.flatnonzero(free)
            free[left] = ~blocked(scene, index, source, objects[asked[left]], positions[asked[left]])
        answer[asked[free], column] = 1
    return answer


def above_horizon(source: np.ndarray, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return whether dot(N, L) > 0, shape (N,)."""
    return dot(normals, source - positions) > 0


def blocked(scene: Scene, index: int, source: np.ndarray, objects: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return whether shape `index` lies strictly between the light and points on the given objects, shape (N,)."""
    shape = scene.shapes[index]
    surface = surface_of(shape)
    own = objects[:, 0] == index
    segments, ends = positions - source, ends_of(np.asarray(scene.camera.eye), positions)
    blocked = np.zeros(len(objects), dtype=bool)
    blocked[~own] = surface.blocks(source, segments[~own], ends[~own])
    blocked[own] = blocked_by_itself(scene, index, source, positions[own])
    if isinstance(surface, Polygons) and not isinstance(shape, Cube) and len(surface.corners) > 1:
        blocked[own] = surface.blocks(source, segments[own], ends[own], without=objects[own, 1])
    return blocked


def blocked_by_itself(scene: Scene, index: int, source: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return whether a convex shape lies between the light and points on its own surface, shape (N,)."""
    shape = scene.shapes[index]
    surface = surface_of(shape)
    if isinstance(surface, Ellipsoid):
        return surface.blocks_itself(source, positions)
    if not isinstance(shape, Cube):
        return np.zeros(len(positions), dtype=bool)
    # Seen from a face, the rest of the cube lies below it: it blocks a light that is below too, and not inside.
    local, local_source = cube_points(shape, positions), cube_points(shape, source[np.newaxis])[0]
    axis = np.abs(local).argmax(axis=1)
    sign = np.where(np.take_along_axis(local, axis[:, np.newaxis], axis=1)[:, 0] < 0, -1.0, 1.0)
    return np.logical_and(sign * local_source[axis] < 0.5, np.abs(local_source).max() > 0.5)
