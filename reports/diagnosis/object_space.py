"""Mistakes of how rays meet shapes, by renderers that take the normal where the ray meets the shape in object space.

The tracer takes it at the world's hit point, which under these mistakes is another: `mistakes/formulas.py` has that of
each. Here rays and feelers are brought into object space, wrongly or not, and met there, by the plainest formulas, with
no trees of boxes. Triangles and meshes lie in the world.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Shape, Sphere, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.stages import clip_interval
from rayproof.reference.analytic.surfaces import surface_of
from rayproof.reports.diagnosis import Given, Way
from rayproof.reports.judge.answers import dot, length

ABOVE = 1e-6  # of a point's coordinates: so far along the normal its feelers start, more than a float's rounding

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


def _rightly(
    linear: np.ndarray, offset: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    back = np.linalg.inv(linear).T
    return (origins - offset) @ back, directions @ back


@dataclass(frozen=True, kw_only=True)
class _Meeting:
    """How rays and feelers meet shapes."""

    into: IntoObject = _rightly
    unit_a: bool = False  # take A = 1 in the sphere's quadratic
    face: Callable[[Shape], Shape] = lambda shape: shape  # what is met for a triangle or mesh


def _meet(
    shape: Shape, origins: np.ndarray, directions: np.ndarray, low: np.ndarray, high: np.ndarray, *, unit_a: bool
) -> np.ndarray:
    """Return the smallest t in (low, high) at which rays of object space meet a unit shape there, or inf."""
    with np.errstate(all="ignore"):
        if isinstance(shape, Sphere) and unit_a:
            start = origins - np.asarray(shape.center)
            middle = -dot(start, directions)
            half = np.sqrt(middle**2 - dot(start, start) + shape.radius**2)
            roots = [middle - half, middle + half]
        elif isinstance(shape, Sphere):
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


def _hits(given: Given, how: _Meeting) -> tuple[np.ndarray, np.ndarray]:
    """Return object and distance of the nearest hits."""
    rays = given.answers[Stage.RAY]
    flat, eye = rays.reshape(-1, 3), np.asarray(given.scene.camera.eye, dtype=np.float64)
    low, high = clip_interval(given.scene, flat)
    best, objects = np.full(len(flat), np.inf), np.full((len(flat), 2), -1.0)
    for index, shape in enumerate(given.scene.shapes):
        if isinstance(shape, Triangle | Mesh):
            crossing, face = surface_of(how.face(shape)).first(eye, flat, low, high)
        else:
            origins, directions = how.into(*_matrix(shape), np.broadcast_to(eye, flat.shape), flat)
            crossing, face = _meet(shape, origins, directions, low, high, unit_a=how.unit_a), np.zeros(len(flat))
        nearer = crossing < best
        best = np.where(nearer, crossing, best)
        count = len(_faces(shape)[1]) if isinstance(shape, Triangle | Mesh) else 1
        objects[nearer, 0], objects[nearer, 1] = index, face[nearer] % count
    return objects.reshape(*rays.shape[:2], 2), best.reshape(*rays.shape[:2], 1)


def _normals(given: Given, how: _Meeting) -> np.ndarray:
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
        origins, directions = how.into(linear, offset, np.broadcast_to(eye, flat.shape), flat)
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


def _visible(given: Given, how: _Meeting) -> np.ndarray:
    """Return which lights are above the horizon with a feeler that meets nothing, brought astray as well."""
    hit = given.answers[Stage.OBJECT][..., 0] >= 0
    points = given.answers[Stage.POSITION][hit]
    columns = []
    for light in given.scene.lights:
        normals, source = given.answers[Stage.NORMAL][hit], np.asarray(light.position, dtype=np.float64)
        starts = points + ABOVE * np.maximum(1.0, length(points))[:, np.newaxis] * normals
        seen = dot(normals, source - points) > 0
        seen &= ~_blocked(given.scene, starts, source, how)
        column = np.zeros(hit.shape)
        column[hit] = seen
        columns.append(column)
    return np.stack(columns, axis=-1)


def _blocked(scene: Scene, points: np.ndarray, source: np.ndarray, how: _Meeting) -> np.ndarray:
    low, high = np.zeros(len(points)), np.ones(len(points))
    found = np.zeros(len(points), dtype=bool)
    for shape in scene.shapes:
        if isinstance(shape, Triangle | Mesh):
            crossing, _ = surface_of(how.face(shape)).first(
                source, points - source, low, high
            )  # from the light, one for all
        else:
            origins, directions = how.into(*_matrix(shape), points, source - points)
            crossing = _meet(shape, origins, directions, low, high, unit_a=how.unit_a)
        found |= np.isfinite(crossing)
    return found


def way_by(into: IntoObject) -> Way:
    """Return the way of a renderer that brings rays and feelers into object space so."""
    return _way_of(_Meeting(into=into))


def _way_of(how: _Meeting) -> Way:
    """Return the way of a renderer whose rays and feelers meet shapes so."""
    return Way(
        stages={
            Stage.OBJECT: lambda given: _hits(given, how)[0],
            Stage.DISTANCE: lambda given: _hits(given, how)[1],
            Stage.NORMAL: lambda given: _normals(given, how),
            Stage.VISIBILITY: lambda given: _visible(given, how),
        }
    )


def _parallelograms(shape: Shape) -> Shape:
    """Return a mesh in which each face has its mirror image beside it, numbered after all faces of the shape."""
    vertices, faces = _faces(shape)
    first, second, third = (vertices[faces[:, corner]] for corner in range(3))
    beside = np.concatenate([second, third, second + third - first])
    count = len(faces)
    numbers = len(vertices) + np.arange(3 * count).reshape(3, count)
    mirrored = np.stack([numbers[0], numbers[2], numbers[1]], axis=-1)
    return Mesh(
        albedo=shape.albedo,
        to_world=shape.to_world,
        two_sided=shape.two_sided,
        vertices=np.concatenate([vertices, beside]).astype(np.float32),
        faces=np.concatenate([faces, mirrored]).astype(np.int32),
    )


def _faces(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(shape, Mesh):
        return np.asarray(shape.vertices), np.asarray(shape.faces)
    assert isinstance(shape, Triangle)
    return np.asarray(shape.vertices, dtype=np.float32), np.array([(0, 1, 2)])


RENORMALISED, MOVED, FORWARD = (_way_of(_Meeting(into=into)) for into in (_renormalised, _moved, _forward))
UNIT_A = _way_of(_Meeting(unit_a=True))
PARALLELOGRAMS = _way_of(_Meeting(face=_parallelograms))
