"""Triangles baked into world space: once in float64, rounded once to float32, the same for every renderer."""

from functools import lru_cache

import numpy as np

from rayproof.cases.scene import IDENTITY, Mesh, Shape, Triangle


@lru_cache(maxsize=64)
def world_triangles(shape: Shape) -> np.ndarray:
    """Return a triangle's or a mesh's world-space corners [m], float32, shape (faces, 3, 3), read-only.

    A mirroring `to_world` would turn the winding around; the last two corners are swapped then, so that the
    winding in world space still gives the specification's normal (inverse transpose of the object normal).

    Raises:
        TypeError: the shape has no triangles.

    """
    if isinstance(shape, Triangle):
        corners = np.asarray(shape.vertices, dtype=np.float64)[np.newaxis]
    elif isinstance(shape, Mesh):
        corners = shape.vertices.astype(np.float64)[shape.faces]
    else:
        raise TypeError(f"{type(shape).__name__} has no triangles")
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    placed = corners if shape.to_world == IDENTITY else corners @ matrix[:3, :3].T + matrix[:3, 3]
    baked = placed.astype(np.float32)
    if np.linalg.det(matrix[:3, :3]) < 0:
        baked = baked[:, [0, 2, 1]]
    baked = np.ascontiguousarray(baked)
    baked.setflags(write=False)
    return baked
