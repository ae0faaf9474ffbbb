"""Every stage from the one before, in float64: nearest hit within the clip interval, position, normal, light."""

from collections.abc import Callable, Mapping

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import light
from rayproof.reference.analytic.camera import view_of
from rayproof.reference.analytic.surfaces import Polygons, outward_normals, surface_of
from rayproof.reference.analytic.vectors import dot, length


def clip_interval(scene: Scene, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the open interval (low, high) of t in which hits count, along directions (N, 3) of any length."""
    camera = scene.camera
    near, far = np.full(len(directions), camera.near), np.full(len(directions), camera.far)
    if scene.clip == "shell":
        return near, far
    if scene.clip == "none":
        return np.zeros(len(directions)), np.full(len(directions), np.inf)
    with np.errstate(all="ignore"):
        depth_speed = directions @ view_of(camera).forward
        return near / depth_speed, far / depth_speed


def nearest(scene: Scene, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (shape index, face index) (N, 2), -1 on a miss, and t (N,), inf on a miss. Equal t: the lower index."""
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    low, high = clip_interval(scene, directions)
    distances, objects = np.full(len(directions), np.inf), np.full((len(directions), 2), -1.0)
    for index, shape in enumerate(scene.shapes):
        crossing, face = surface_of(shape).first(eye, directions, low, high)
        nearer = crossing < distances
        distances = np.where(nearer, crossing, distances)
        objects[nearer, 0], objects[nearer, 1] = index, face[nearer]
    return objects, distances


def distances_to(scene: Scene, directions: np.ndarray, objects: np.ndarray) -> np.ndarray:
    """Return t (N,) of the first crossing, inside the clip interval, with the given (shape, face); inf without."""
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    low, high = clip_interval(scene, directions)
    distances = np.full(len(directions), np.inf)
    for index, shape in enumerate(scene.shapes):
        asked = np.flatnonzero(objects[:, 0] == index)
        surface = surface_of(shape)
        arguments = (eye, directions[asked], low[asked], high[asked])
        if isinstance(surface, Polygons):
            distances[asked] = surface.first(*arguments, only=objects[asked, 1])[0]
        else:
            distances[asked] = surface.first(*arguments)[0]
    return distances


# Each stage computed from the stages before it, whoever computed those: one table, used for all answers.
#
# Arrays are flat here: one row per ray. What each stage reads is what blame may assume about it.


Rows = Mapping[Stage, np.ndarray]  # stage -> (N, channels)


def rays(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return unit directions (N, 3) through image points (N, 2) [px]."""
    directions = view_of(scene.camera).directions(points)
    return directions / length(directions)[:, np.newaxis]


def _objects(scene: Scene, given: Rows) -> np.ndarray:
    return nearest(scene, given[Stage.RAY])[0]


def _distances(scene: Scene, given: Rows) -> np.ndarray:
    return distances_to(scene, given[Stage.RAY], given[Stage.OBJECT])[:, np.newaxis]


def _positions(scene: Scene, given: Rows) -> np.ndarray:
    hit = (given[Stage.OBJECT][:, :1] >= 0) & np.isfinite(given[Stage.DISTANCE])
    with np.errstate(all="ignore"):
        return np.where(hit, np.asarray(scene.camera.eye) + given[Stage.DISTANCE] * given[Stage.RAY], 0)


def _normals(scene: Scene, given: Rows) -> np.ndarray:
    """Outward normals, turned towards the viewer on two-sided shapes."""
    directions, objects, positions = given[Stage.RAY], given[Stage.OBJECT], given[Stage.POSITION]
    normals = np.zeros((len(objects), 3))
    for index, shape in enumerate(scene.shapes):
        here = objects[:, 0] == index
        outward = outward_normals(shape, positions[here], objects[here, 1])
        away = dot(outward, directions[here]) > 0
        normals[here] = np.where(away[:, np.newaxis] & shape.two_sided, -outward, outward)
    return normals


def _visibility(scene: Scene, given: Rows) -> np.ndarray:
    return light.visibility(scene, given[Stage.OBJECT], given[Stage.POSITION], given[Stage.NORMAL])


def _irradiance(scene: Scene, given: Rows) -> np.ndarray:
    arriving = light.irradiance(scene, given[Stage.POSITION], given[Stage.NORMAL], given[Stage.VISIBILITY])
    return np.where(given[Stage.OBJECT][:, :1] >= 0, arriving, 0)


def _exitance(scene: Scene, given: Rows) -> np.ndarray:
    return light.exitance(scene, given[Stage.OBJECT], given[Stage.IRRADIANCE])


def _radiance(scene: Scene, given: Rows) -> np.ndarray:
    return light.radiance(scene, given[Stage.RAY], given[Stage.OBJECT], given[Stage.NORMAL], given[Stage.EXITANCE])


# In the specification's order; each reads only stages above it.
NEXT: dict[Stage, Callable[[Scene, Rows], np.ndarray]] = {
    Stage.OBJECT: _objects,
    Stage.DISTANCE: _distances,
    Stage.POSITION: _positions,
    Stage.NORMAL: _normals,
    Stage.VISIBILITY: _visibility,
    Stage.IRRADIANCE: _irradiance,
    Stage.EXITANCE: _exitance,
    Stage.RADIANCE: _radiance,
}


def chain(scene: Scene, points: np.ndarray, last: Stage) -> dict[Stage, np.ndarray]:
    """Return every image stage up to `last` at image points (N, 2) [px]."""
    rows = {Stage.RAY: rays(scene, points)}
    if last is Stage.RAY:
        return rows
    # Object and distance are one search.
    rows[Stage.OBJECT], distances = nearest(scene, rows[Stage.RAY])
    rows[Stage.DISTANCE] = distances[:, np.newaxis]
    order = list(NEXT)
    for stage in order[2 : order.index(last) + 1]:
        rows[stage] = NEXT[stage](scene, rows)
    return rows
