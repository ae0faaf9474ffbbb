"""The specification's shapes as PyVista surfaces in world space, for looking at."""

from typing import Any

import numpy as np

from rayproof.cases.baking import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle

ROUND = 48  # corners of a sphere's equator
MOST_TRIANGLES = 100_000  # of a mesh: hardly more than a picture has pixels


def surface(shape: Shape, *, patch: np.ndarray | None, margin: float = 0.0, around: int = ROUND) -> Any:
    """Return `shape` in world space; of an infinite plane the part around the world points `patch`, or None.

    `around` is the number of corners of a sphere's equator. A mesh of more than `MOST_TRIANGLES` is thinned.
    """
    import pyvista

    if isinstance(shape, Triangle | Mesh):
        corners = thinned(world_triangles(shape), MOST_TRIANGLES)
        faces = np.arange(corners.size // 3).reshape(-1, 3)
        return pyvista.PolyData.from_regular_faces(corners.reshape(-1, 3).astype(np.float64), faces)
    if isinstance(shape, Sphere):
        mesh = pyvista.Sphere(
            radius=shape.radius, center=shape.center, theta_resolution=around, phi_resolution=2 * around // 3
        )
    elif isinstance(shape, Cube):
        mesh = pyvista.Cube()
    elif isinstance(shape, Square):
        mesh = _rectangle(-0.5, 0.5, -0.5, 0.5)
    elif isinstance(shape, Plane):
        if patch is None:
            return None
        mesh = _plane_patch(shape, patch, margin)
    else:
        return None
    return mesh.transform(np.asarray(shape.to_world, dtype=np.float64), inplace=False)


def thinned(corners: np.ndarray, most: int) -> np.ndarray:
    """Return triangles (faces, 3, 3) that look like the given ones, where these are more than about `most`.

    Corners in one cell of a grid become the first of them, and triangles of which two corners do so are left out. Where
    hardly any is left, for all are smaller than a cell and lie apart, some of them stand for all.
    """
    if len(corners) <= most:
        return corners
    points = corners.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    cells = max(2, int((most / 6) ** 0.5))  # along the longest side: a surface meets about three times its square
    scale = cells / (float((high - low).max()) or 1.0)
    places = np.zeros(len(points), dtype=np.int64)
    for axis in range(3):
        places = places * (cells + 1) + ((points[:, axis] - low[axis]) * scale).astype(np.int64)
    _, first, number = np.unique(places, return_index=True, return_inverse=True)
    faces = number.reshape(-1, 3)
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    if len(faces) < most // 100:
        return corners[:: -(-len(corners) // most)]
    ordered = np.sort(faces, axis=1)
    once = np.unique((ordered[:, 0] * len(first) + ordered[:, 1]) * len(first) + ordered[:, 2], return_index=True)[1]
    return points[first[faces[np.sort(once)]]]


def _plane_patch(shape: Plane, patch: np.ndarray, margin: float) -> Any:
    """Return the part of the plane, in its own space, below the points of `patch` that lie on it, else below all."""
    inverse = np.linalg.inv(np.asarray(shape.to_world, dtype=np.float64))
    local = np.asarray(patch, dtype=np.float64) @ inverse[:3, :3].T + inverse[:3, 3]
    # A grazing view has hits out to the horizon: the middle nine tenths are what is worth seeing.
    on = local[np.abs(local[:, 2]) < 1e-3 * max(1.0, float(np.abs(local).max()))]
    used = on if len(on) else local
    low, high = np.quantile(used[:, :2], 0.05, axis=0), np.quantile(used[:, :2], 0.95, axis=0)
    # The margin is a world length; the plane's own axes may be scaled.
    scale = np.linalg.norm(np.asarray(shape.to_world, dtype=np.float64)[:3, :2], axis=0)
    low, high = low - margin / scale, high + margin / scale
    return _rectangle(float(low[0]), float(high[0]), float(low[1]), float(high[1]))


def _rectangle(x0: float, x1: float, y0: float, y1: float) -> Any:
    import pyvista

    corners = np.asarray([(x0, y0, 0), (x1, y0, 0), (x1, y1, 0), (x0, y1, 0)], dtype=np.float64)
    return pyvista.PolyData.from_regular_faces(corners, np.asarray([[0, 1, 2, 3]]))
