"""Mistakes of the way into object space, XF-1, by renderers that take the normal where the ray meets the shape there.

The tracer takes it at the world's hit point, which under these mistakes is another: `mistakes/formulas.py` has that of
each. Here rays and feelers are brought into object space wrongly and met there, by the plainest formulas. Triangles and
meshes lie in the world and are met rightly.
"""

from collections.abc import Callable

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Shape, Sphere, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.nearest import clip_interval
from rayproof.reference.analytic.surfaces import surface_of
from rayproof.reports.diagnosis import Given, Way
from rayproof.reports.judge.channels import dot, length

ABOVE = 1e-9  # of a point's coordinates: so far along the normal its feelers start

# From linear part, translation, origins and directions (N, 3) in the world to both in object space.
IntoObject = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def _renormalised(
    linear: np.ndarray, offset: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    back = np.linalg.inv(linear).T
    turned = directions @ back
    return (origins - offset) @ back, turned / np.linalg.norm(turned, axis=-1, keepdims=True)


def _moved(
    linear: np.ndarray, offset: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    back = np.linalg.inv(linear).T
    return (origins - offset) @ back, (directions - offset) @ back


def _forward(
    linear: np.ndarray, offset: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    return origins @ linear.T + offset, directions @ linear.T


def _meet(shape: Shape, origins: np.ndarray, directions: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the smallest t in (low, high) at which rays of object space meet a unit shape there, or inf."""
    with np.errstate(all="ignore"):
        if isinstance(shape, Sphere):
            start = origins - np.asarray(shape.center)
            size = dot(directions, directions)
            middle = -dot(start, directions) / size
            foot = start + middle[:, np.newaxis] * directions
            half = np.sqrt((shape.radius**2 - dot(foot, foot)) / size)
            roots = [middle - half, middle + half]
        elif isinstance(shape, Cube):
            ends = np.sort([(-0.5 - origins) / directions, (0.5 - origins) / directions], axis=0)
            enter, leave = np.nanmax(ends[0], axis=-1), np.nanmin(ends[1], axis=-1)
            beside = np.any((directions == 0) & (np.abs(origins) > 0.5), axis=-1)
            missed = (enter > leave) | beside
            roots = [np.where(missed, np.nan, root) for root in (enter, leave)]
        else:
            root = -origins[:, 2] / directions[:, 2]
            met = origins + root[:, np.newaxis] * directions
            within = isinstance(shape, Plane) | np.all(np.abs(met[:, :2]) < 0.5, axis=-1)
            roots = [np.where(within, root, np.nan)]
        found = [np.where((root > low) & (root < high), root, np.inf) for root in roots]
    return np.min(found, axis=0)


def _matrix(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    return matrix[:3, :3], matrix[:3, 3]


def _hits(given: Given, wrong: IntoObject) -> tuple[np.ndarray, np.ndarray]:
    """Return object and distance of the nearest hits."""
    rays = given.answers[Stage.RAY]
    flat, eye = rays.reshape(-1, 3), np.asarray(given.scene.camera.eye, dtype=np.float64)
    low, high = clip_interval(given.scene, flat)
    best, objects = np.full(len(flat), np.inf), np.full((len(flat), 2), -1.0)
    for index, shape in enumerate(given.scene.shapes):
        if isinstance(shape, Triangle | Mesh):
            crossing, face = surface_of(shape).first(eye, flat, low, high)
        else:
            origins, directions = wrong(*_matrix(shape), np.broadcast_to(eye, flat.shape), flat)
            crossing, face = _meet(shape, origins, directions, low, high), np.zeros(len(flat))
        nearer = crossing < best
        best = np.where(nearer, crossing, best)
        objects[nearer, 0], objects[nearer, 1] = index, face[nearer]
    return objects.reshape(*rays.shape[:2], 2), best.reshape(*rays.shape[:2], 1)


def _normals(given: Given, wrong: IntoObject) -> np.ndarray:
    """Return the normals at the points of object space that the rays met."""
    found = np.array(given.right, dtype=np.float64)
    objects, rays = given.answers[Stage.OBJECT][..., 0], given.answers[Stage.RAY]
    eye = np.asarray(given.scene.camera.eye, dtype=np.float64)
    for index, shape in enumerate(given.scene.shapes):
        here = objects == index
        if isinstance(shape, Triangle | Mesh) or not here.any():
            continue
        linear, offset = _matrix(shape)
        flat = rays[here]
        origins, directions = wrong(linear, offset, np.broadcast_to(eye, flat.shape), flat)
        normals = _local_normals(shape, origins + given.answers[Stage.DISTANCE][here] * directions) @ np.linalg.inv(
            linear
        )
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        turns = shape.two_sided & (dot(normals, flat) > 0)
        found[here] = np.where(turns[:, np.newaxis], -normals, normals)
    return found


def _local_normals(shape: Shape, points: np.ndarray) -> np.ndarray:
    if isinstance(shape, Sphere):
        return points - np.asarray(shape.center)
    if isinstance(shape, Cube):
        axis = np.abs(points).argmax(axis=-1)
        return np.eye(3)[axis] * np.sign(np.take_along_axis(points, axis[:, np.newaxis], axis=-1))
    return np.broadcast_to((0.0, 0.0, 1.0), points.shape)


def _visible(given: Given, wrong: IntoObject) -> np.ndarray:
    """Return which lights are above the horizon with a feeler that meets nothing, brought astray as well."""
    hit = given.answers[Stage.OBJECT][..., 0] >= 0
    points = given.answers[Stage.POSITION][hit]
    columns = []
    for light in given.scene.lights:
        normals, source = given.answers[Stage.NORMAL][hit], np.asarray(light.position, dtype=np.float64)
        starts = points + ABOVE * np.maximum(1.0, length(points))[:, np.newaxis] * normals
        seen = dot(normals, source - points) > 0
        seen &= ~_blocked(given.scene, starts, source, wrong)
        column = np.zeros(hit.shape)
        column[hit] = seen
        columns.append(column)
    return np.stack(columns, axis=-1)


def _blocked(scene: Scene, points: np.ndarray, source: np.ndarray, wrong: IntoObject) -> np.ndarray:
    low, high = np.zeros(len(points)), np.ones(len(points))
    found = np.zeros(len(points), dtype=bool)
    for shape in scene.shapes:
        if isinstance(shape, Triangle | Mesh):
            crossing, _ = surface_of(shape).first(source, points - source, low, high)  # from the light, one for all
        else:
            origins, directions = wrong(*_matrix(shape), points, source - points)
            crossing = _meet(shape, origins, directions, low, high)
        found |= np.isfinite(crossing)
    return found


def way_of(wrong: IntoObject) -> Way:
    """Return the way of a renderer that brings rays and feelers into object space wrongly."""
    return Way(
        stages={
            Stage.OBJECT: lambda given: _hits(given, wrong)[0],
            Stage.DISTANCE: lambda given: _hits(given, wrong)[1],
            Stage.NORMAL: lambda given: _normals(given, wrong),
            Stage.VISIBILITY: lambda given: _visible(given, wrong),
        }
    )


RENORMALISED, MOVED, FORWARD = way_of(_renormalised), way_of(_moved), way_of(_forward)
