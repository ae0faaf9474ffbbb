"""Triangles on the host: object-space normals, and which triangles are degenerate and never hit."""

import numpy as np

from cases.baking import world_triangles
from cases.scene import Mesh, Shape, Triangle


def object_corners(shape: Shape) -> np.ndarray:
    """Return object-space corners [m], float64 of float32 numbers, shape (faces, 3, 3); TypeError without triangles."""
    if isinstance(shape, Triangle):
        return np.asarray(shape.vertices, dtype=np.float64)[np.newaxis]
    if isinstance(shape, Mesh):
        return shape.vertices.astype(np.float64)[shape.faces]
    raise TypeError(f"{type(shape).__name__} has no triangles")


def _doubled_areas(corners: np.ndarray) -> np.ndarray:
    """Return the cross product of two edges [m^2]: by winding, its length is twice the area."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def object_normals(shape: Shape) -> np.ndarray:
    """Return unit object-space normals by counter-clockwise winding, (faces, 3); of degenerate triangles (0, 0, 0)."""
    areas = _doubled_areas(object_corners(shape))
    lengths = np.linalg.norm(areas, axis=1, keepdims=True)
    return np.divide(areas, lengths, out=np.zeros_like(areas), where=lengths > 0)


def degenerate(shape: Shape) -> np.ndarray:
    """Return (faces,) booleans: no area in object space, or none left after the corners were rounded in world space."""
    baked = world_triangles(shape).astype(np.float64)
    kept = np.any(_doubled_areas(object_corners(shape)), axis=1) & np.any(_doubled_areas(baked), axis=1)
    return np.logical_not(kept)


def slenderness(shape: Shape) -> np.ndarray:
    """Return (faces,) the product of two edges over twice the area, at least 1: what rounding is multiplied by."""
    baked = world_triangles(shape).astype(np.float64)
    edges = np.linalg.norm(baked[:, 1] - baked[:, 0], axis=1) * np.linalg.norm(baked[:, 2] - baked[:, 0], axis=1)
    areas = np.linalg.norm(_doubled_areas(baked), axis=1)
    return np.divide(edges, areas, out=np.ones_like(edges), where=areas > 0)
