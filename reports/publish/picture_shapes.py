"""The specification's shapes as PyVista surfaces in world space, for looking at."""

from typing import Any

import numpy as np

from cases.baking import world_triangles
from cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle

ROUND = 48  # corners of a sphere's equator


def surface(shape: Shape, *, patch: np.ndarray | None, margin: float = 0.0, around: int = ROUND) -> Any:
    """Return `shape` in world space; of an infinite plane the part around the world points `patch`, or None.

    `around` is the number of corners of a sphere's equator.
    """
    import pyvista

    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape)
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
