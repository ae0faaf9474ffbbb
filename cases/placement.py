"""Model matrices composed of named motions (`translation`, `shear`, ...), `camera_around`, world-space triangles.

Triangles are baked into world space: once in float64, rounded once to float32, the same for every renderer.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import atan2, cos, degrees, radians, sin
from typing import Any

import numpy as np

from rayproof.cases.scene import IDENTITY, Camera, Matrix, Mesh, Shape, Triangle, Vector


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) scaled to length 1; a zero vector gives NaN."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def frame(eye: Any, target: Any, up: Any) -> np.ndarray:
    """Return the axes right, up and forward of a camera at `eye` [m], unit vectors as rows (3, 3), in float64 (CAM-1).

    It is for modules that need no independence; tracer and oracles compute their own frames.
    """
    forward = np.subtract(target, eye, dtype=np.float64)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, np.asarray(up, dtype=np.float64))
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, forward), forward])


def vector(values: Any) -> Vector:
    """Return three numbers as a tuple of Python floats."""
    x, y, z = map(float, values)
    return x, y, z


def matrix(values: Any) -> Matrix:
    """Return a 4x4 matrix as tuples of Python floats."""
    first, second, third, last = ((float(a), float(b), float(c), float(d)) for a, b, c, d in np.asarray(values))
    return (first, second, third, last)


def _linear(entries: Sequence[Sequence[float]]) -> Matrix:
    whole = np.eye(4)
    whole[:3, :3] = entries
    return matrix(whole)


def translation(x: float, y: float, z: float) -> Matrix:
    """Return the matrix that moves by (x, y, z) [m]."""
    whole = np.eye(4)
    whole[:3, 3] = (x, y, z)
    return matrix(whole)


def scaling(x: float, y: float, z: float) -> Matrix:
    """Return the matrix that scales along the axes; a negative factor mirrors."""
    return _linear(np.diag((x, y, z)).tolist())


def shear(*, xy: float = 0.0, xz: float = 0.0, yz: float = 0.0) -> Matrix:
    """Return the matrix that adds xy y + xz z to x and yz z to y."""
    return _linear(((1.0, xy, xz), (0.0, 1.0, yz), (0.0, 0.0, 1.0)))


def rotation(axis: Vector, angle: float) -> Matrix:
    """Return the rotation by `angle` degrees about `axis`, counter-clockwise seen from its tip (Rodrigues, 1840)."""
    unit = np.asarray(axis, dtype=np.float64) / np.linalg.norm(axis)
    cross = np.array([[0, -unit[2], unit[1]], [unit[2], 0, -unit[0]], [-unit[1], unit[0], 0]])
    turn = radians(angle)
    return _linear((np.eye(3) + sin(turn) * cross + (1 - cos(turn)) * (cross @ cross)).tolist())


def compose(*motions: Matrix) -> Matrix:
    """Return the product of `motions`: the last one acts first, as in the formula."""
    whole = np.eye(4)
    for motion in motions:
        whole = whole @ np.asarray(motion)
    return matrix(whole)


def placed(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return the linear part (3, 3) and the translation (3,) [m] of a shape's model matrix, in float64."""
    entries = np.asarray(shape.to_world, dtype=np.float64)
    return entries[:3, :3], entries[:3, 3]


def mapped(to_world: Matrix, point: Vector) -> Vector:
    """Return the world point [m] of an object-space point [m]."""
    return vector((np.asarray(to_world) @ (*point, 1.0))[:3])


def camera_around(
    target: Vector,
    *,
    distance: float,
    azimuth: float,
    elevation: float,
    width: int,
    height: int,
    fovy: float = 40.0,
    roll: float = 7.0,
    near: float = 0.1,
    far: float = 100.0,
) -> Camera:
    """Return a camera that sees `target` [m] from `distance` [m] in the given direction, with z roughly upward.

    Angles in degrees: `azimuth` from +x towards +y, `elevation` above the xy plane, `roll` about the viewing axis.
    """
    turn, rise, bank = radians(azimuth), radians(elevation), radians(roll)
    outward = np.array([cos(rise) * cos(turn), cos(rise) * sin(turn), sin(rise)])
    upward = np.array([-sin(rise) * cos(turn), -sin(rise) * sin(turn), cos(rise)])
    up = cos(bank) * upward + sin(bank) * np.cross(outward, upward)
    eye = np.asarray(target) + distance * outward
    return Camera(
        eye=vector(eye),
        target=target,
        up=vector(up),
        fovy=fovy,
        width=width,
        height=height,
        near=near,
        far=far,
    )


def frontal_fovy(*, height: int, pixel: float, distance: float) -> float:
    """Return the vertical angle [degrees] for pixels with a side of `pixel` [m] on a plane `distance` [m] ahead."""
    return 2 * degrees(atan2(height * pixel / 2, distance))


@lru_cache(maxsize=64)
def world_triangles(shape: Shape) -> np.ndarray:
    """Return a triangle's or a mesh's world-space corners [m], float32, shape (faces, 3, 3), read-only.

    A mirroring `to_world` reverses the winding; then the last two corners are swapped, so that the winding in world
    space still gives the specification's normal (inverse transpose of the object normal).

    Raises:
        TypeError: the shape has no triangles.

    """
    if isinstance(shape, Triangle):
        corners = np.asarray(shape.vertices, dtype=np.float64)[np.newaxis]
    elif isinstance(shape, Mesh):
        corners = shape.vertices.astype(np.float64)[shape.faces]
    else:
        raise TypeError(f"{type(shape).__name__} has no triangles")
    to_world = np.asarray(shape.to_world, dtype=np.float64)
    placed = corners if shape.to_world == IDENTITY else corners @ to_world[:3, :3].T + to_world[:3, 3]
    baked = placed.astype(np.float32)
    if np.linalg.det(to_world[:3, :3]) < 0:
        baked = baked[:, [0, 2, 1]]
    baked = np.ascontiguousarray(baked)
    baked.setflags(write=False)
    return baked
