"""A scene for Embree: rays of the camera in world space, clip interval, all shapes as triangles.

Source: the specification, CAM-1 and CAM-3; camera space has x right, y up and z forward, so that depth is z.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Camera, Cube, Mesh, Scene, Shape, Square, Triangle


def orientation(camera: Camera) -> np.ndarray:
    """Return the rotation from camera space to the world: its columns are right, up and forward, (3, 3)."""
    forward = np.array(camera.target, dtype=np.float64) - np.array(camera.eye, dtype=np.float64)
    # Orthonormal columns that span forward and up, in this order; QR may turn any of them around.
    basis, triangle = np.linalg.qr(np.column_stack([forward, camera.up]))
    forward, up = (basis * np.sign(np.diag(triangle))).T
    return np.column_stack([np.cross(forward, up), up, forward])


def directions(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return unit directions through the pixel centres, (lines * width, 3) row by row, and their depth per metre."""
    half = np.tan(camera.alpha)
    x = (2 * np.arange(camera.width) + 1 - camera.width) / camera.height * half
    rows = np.arange(camera.height)
    y = (camera.height - 1 - 2 * rows) / camera.height * half
    local = np.stack([*np.meshgrid(x, y), np.ones((camera.height, camera.width))], axis=-1).reshape(-1, 3)
    local /= np.sqrt(np.einsum("ij,ij->i", local, local))[:, np.newaxis]
    return local @ orientation(camera).T, local[:, 2]


def interval(scene: Scene, depth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return from where to where [m] along rays of that depth per metre a hit counts, (n,) each."""
    near, far = scene.camera.near, scene.camera.far
    if scene.clip == "none":
        near, far = 0.0, np.inf
    per_metre = depth if scene.clip == "depth" else np.ones_like(depth)
    return near / per_metre, far / per_metre


# Every flat shape as triangles, in float64 and seen from the eye, with what each of them belongs to.
#
# Embree keeps float32 numbers. Theirs are those relative to the eye, because there float32 resolves best what matters;
# the float64 ones are kept beside them, since they decide how far away a triangle's plane is.


SQUARE = np.array([[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]])
# A square's two halves, both counter-clockwise.
HALVES = [[0, 1, 2], [0, 2, 3]]


@dataclass(frozen=True, kw_only=True)
class Facets:
    """n triangles."""

    corners: np.ndarray  # (n, 3, 3) m, relative to the eye
    normal: np.ndarray  # (n, 3) unit, as the surface is oriented
    shape: np.ndarray  # (n,) index into the scene's shapes
    face: np.ndarray  # (n,) a mesh's triangle, else 0


@lru_cache(maxsize=4)
def facets(scene: Scene) -> Facets:
    """Return the triangles of all shapes, without those that have no area.

    Raises:
        TypeError: a shape is not flat.

    """
    corners, normals, shapes, faces = [np.zeros((0, 3, 3))], [np.zeros((0, 3))], [], []
    for index, shape in enumerate(scene.shapes):
        world, normal = _triangles(shape)
        kept = np.flatnonzero(np.any(np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0]) != 0, axis=1))
        corners.append(world[kept] - np.asarray(scene.camera.eye))
        normals.append(normal[kept])
        shapes += [index] * len(kept)
        faces += kept.tolist() if isinstance(shape, Mesh) else [0] * len(kept)
    return Facets(
        corners=np.concatenate(corners),
        normal=np.concatenate(normals),
        shape=np.array(shapes, dtype=int),
        face=np.array(faces, dtype=int),
    )


def _triangles(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return a shape's world-space triangles (n, 3, 3) [m] in float64 and their normals (n, 3)."""
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    if isinstance(shape, Triangle | Mesh):
        # The baked corners, which every renderer gets; the normal is that of object space.
        local = _object_corners(shape)
        normal = np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])
        return world_triangles(shape).astype(np.float64), _to_world(normal, matrix)
    if isinstance(shape, Square | Cube):
        sides = _cube() if isinstance(shape, Cube) else SQUARE[np.newaxis]
        local = sides[:, HALVES].reshape(-1, 3, 3)
        normal = np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])
        return local @ matrix[:3, :3].T + matrix[:3, 3], _to_world(normal, matrix)
    raise TypeError(f"{type(shape).__name__} is not flat")


def _cube() -> np.ndarray:
    """Return the unit cube's sides, counter-clockwise seen from outside, (6, 4, 3)."""
    top = SQUARE + np.array([0.0, 0.0, 0.5])
    # Cyclic permutations are rotations, and so keep the winding; a turn by 180 degrees about x does for the far sides.
    tops = [np.roll(top, turn, axis=1) for turn in range(3)]
    bottom = top * (1.0, -1.0, -1.0)
    return np.array([*tops, *(np.roll(bottom, turn, axis=1) for turn in range(3))])


def _object_corners(shape: Triangle | Mesh) -> np.ndarray:
    if isinstance(shape, Triangle):
        return np.asarray(shape.vertices, dtype=np.float64)[np.newaxis]
    return shape.vertices.astype(np.float64)[shape.faces]


def _to_world(normal: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return object-space normals (n, 3) of any length by the inverse transpose (NRM-3), unit."""
    # Solved rather than inverted: M^T N = n.
    world = np.linalg.solve(matrix[:3, :3].T, normal.T).T
    length = np.linalg.norm(world, axis=1, keepdims=True)
    # A triangle without area in object space has no normal; it is left out.
    return np.divide(world, length, out=np.zeros_like(world), where=length > 0)
