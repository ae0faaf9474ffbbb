"""Shapes in POV-Ray's scene description language (SDL), with float64 digits.

POV-Ray takes any affine matrix on any primitive and turns normals by the inverse transpose, also under mirrors. Its
meshes keep float32 normals, so triangles are single ones in nested unions. Everything is scaled by a power of two,
object space included, because POV-Ray's tolerances are lengths: exact, and M' = S M S^-1 keeps M's linear part.
"""

from collections.abc import Callable

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle

Texture = Callable[[int], str]  # face index -> SDL

# Triangles in the innermost unions: a union tries each of its members.
FEW = 16
TRIANGLE = "triangle { " + ", ".join(["<%.17g,%.17g,%.17g>"] * 3)


def vector(values: object) -> str:
    """Return an SDL vector with every digit of float64."""
    return "<" + ",".join(f"{value:.17g}" for value in np.ravel(np.asarray(values, dtype=np.float64)).tolist()) + ">"


def solid(shape: Shape, scale: float, texture: Texture) -> str | None:
    """Return the shape as an SDL object, `scale` times as large, or None if it has no area.

    Raises:
        LookupError: an unknown kind of shape.

    """
    if isinstance(shape, Triangle | Mesh):
        return _triangles(shape, scale, texture)
    half = vector([scale / 2] * 3)
    end = f"{texture(0)} {_matrix(shape, scale)} }}"
    if isinstance(shape, Sphere):
        center = vector(np.multiply(shape.center, scale))
        return f"sphere {{ {center}, {shape.radius * scale:.17g} {end}"
    if isinstance(shape, Cube):
        return f"box {{ -{half}, {half} {end}"
    if isinstance(shape, Square):
        corners = [
            vector(np.multiply(corner, scale / 2)) for corner in ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
        ]
        return f"polygon {{ 4, {', '.join(corners)} {end}"
    if isinstance(shape, Plane):
        return f"plane {{ <0,0,1>, 0 {end}"
    raise LookupError(f"POV-Ray has not been taught the shape {type(shape).__name__}")


def _matrix(shape: Shape, scale: float) -> str:
    """Return `to_world` in SDL's order: the columns of the linear part, then the translation."""
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    return f"matrix {vector([*matrix[:3, :3].T.ravel(), *(matrix[:3, 3] * scale)])}"


def _triangles(shape: Triangle | Mesh, scale: float, texture: Texture) -> str | None:
    corners = world_triangles(shape).astype(np.float64)
    kept = np.flatnonzero(_area(corners) & _area(_object_corners(shape)))
    if not len(kept):
        return None
    corners *= scale
    # POV-Ray's normal is (first - second) x (third - second): against the winding, hence the order.
    ordered = corners[:, [0, 2, 1]].reshape(-1, 9).tolist()
    texts = {face: f"{TRIANGLE % tuple(ordered[face])} {texture(face)} }}" for face in kept.tolist()}
    return _union(kept, corners, texts)


def _union(faces: np.ndarray, corners: np.ndarray, texts: dict[int, str]) -> str:
    """Return triangles in nested unions with boxes around them, halved along the longest side."""
    if len(faces) == 1:
        return texts[int(faces[0])]
    if len(faces) <= FEW:
        return f"union {{ {' '.join(texts[int(face)] for face in faces)} {_box(corners[faces])} }}"
    centers = corners[faces].mean(axis=1)
    order = np.argsort(centers[:, np.argmax(np.ptp(centers, axis=0))], kind="stable")
    lower, upper = np.array_split(faces[order], 2)
    inner = f"{_union(lower, corners, texts)} {_union(upper, corners, texts)}"
    return f"union {{ {inner} {_box(corners[faces])} }}"


def _box(corners: np.ndarray) -> str:
    """Return a bound with room for rounding: a bound that cuts would be a hole."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    room = 1e-3 * (high - low).max() + 1e-9 * np.abs([low, high]).max()
    return f"bounded_by {{ box {{ {vector(low - room)}, {vector(high + room)} }} }}"


def _object_corners(shape: Triangle | Mesh) -> np.ndarray:
    if isinstance(shape, Triangle):
        return np.asarray(shape.vertices, dtype=np.float64)[np.newaxis]
    return shape.vertices.astype(np.float64)[shape.faces]


def _area(corners: np.ndarray) -> np.ndarray:
    """Return which triangles have an area."""
    return np.any(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) != 0, axis=1)
