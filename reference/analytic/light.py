"""Visibility, irradiance, exitance and radiance of diffuse surfaces under point lights (RAD-1 to RAD-4, `two_sided`).

Source: an isotropic source of flux Phi sends Phi / (4 pi) into a unit solid angle, and a surface element at distance r
whose normal is turned by theta fills cos(theta) / r^2 of it.
"""

import numpy as np

from rayproof.cases.scene import Cube, Scene
from rayproof.reference.analytic.surfaces import Ellipsoid, Polygons, cube_points, surface_of
from rayproof.reference.analytic.vectors import dot, ends_of, length


def irradiance(scene: Scene, positions: np.ndarray, normals: np.ndarray, visible: np.ndarray) -> np.ndarray:
    """Return E [W/m^2] per channel, the sum over visible lights, shape (N, 3)."""
    total = np.zeros((len(positions), 3))
    with np.errstate(all="ignore"):
        for column, light in enumerate(scene.lights):
            offset = np.asarray(light.position) - positions
            # Scaled by its greatest component: r^2 alone could overflow, or vanish.
            size = np.abs(offset).max(axis=1)
            scaled = offset / size[:, np.newaxis]
            stretch = length(scaled)
            cosine = np.clip(dot(normals, scaled) / stretch, 0, None)
            lit = (visible[:, column] > 0) & (cosine > 0)
            for channel in range(3):
                if scene.shading == "simplified":
                    part = light.flux[channel] * np.minimum(cosine, 1)
                else:
                    part = light.flux[channel] / (4 * np.pi) * cosine / stretch / stretch / size / size
                total[:, channel] += np.where(lit, part, 0)
    return total


def exitance(scene: Scene, objects: np.ndarray, arriving: np.ndarray) -> np.ndarray:
    """Return M = albedo E [W/m^2], shape (N, 3)."""
    # A number that is no shape's comes from a renderer under test: nothing is lit there, as on a miss.
    known = (objects[:, 0] >= 0) & (objects[:, 0] < len(scene.shapes))
    albedos = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])
    albedo = albedos[np.where(known, objects[:, 0], -1).astype(int)]
    with np.errstate(all="ignore"):
        # A black surface under an infinite irradiance is black, not NaN.
        return np.where(albedo == 0, 0, albedo * arriving)


def radiance(
    scene: Scene, directions: np.ndarray, objects: np.ndarray, normals: np.ndarray, leaving: np.ndarray
) -> np.ndarray:
    """Return L [W/(m^2 sr)] towards the camera, 0 from behind a one-sided surface, shape (N, 3).

    A two-sided surface needs no question of its own: its normal is turned towards the viewer already.
    """
    seen = (objects[:, 0] >= 0) & (dot(normals, directions) < 0)
    scale = 1.0 if scene.shading == "simplified" else 1 / np.pi
    return np.where(seen[:, np.newaxis], leaving * scale, 0)


# Visibility of lights: the open segment from a hit point to a light meets nothing (LIT-1).
#
# The surface that was hit is divided out by algebra, never by an epsilon: a flat face cannot block itself, an ellipsoid
# or a cube does so exactly where the light's side says so. So there is no acne to suppress, and a point that lies a
# rounding off its surface is treated as lying on it. A surface that coincides with the hit one is another one, which
# holds the point as well: the open segment does not meet it there.


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
