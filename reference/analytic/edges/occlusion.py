"""What cannot matter: everything behind a surface that keeps standing in front of it.

Behind a flat face is the far side of its plane. Behind an ellipsoid, within its outline, is the far side of the polar
plane of the apex, which holds the outline itself. The same planes bound what can stand between a light and a point.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.reference.analytic.ellipsoids import Ellipsoid
from rayproof.reference.analytic.vectors import dot, length

# Float64 roundings of a plane's height, relative to the coordinates that enter it, with room to spare.
ROUNDING = 1e-12


@dataclass(frozen=True, kw_only=True)
class Screens:
    """A half-space per ray: points with normal . y + offset > 0 are in front; an infinite offset hides nothing.

    What touches the plane counts as hidden or not by `hides_touching`.
    """

    normals: np.ndarray  # (N, 3) unit
    offsets: np.ndarray  # (N,) m
    hides_touching: bool

    def hides_hulls(self, rays: np.ndarray, hulls: np.ndarray) -> np.ndarray:
        """Return whether the convex hulls of points (K, corners, 3) lie behind, for each of the rays, shape (n, K)."""
        normals = self.normals[rays]
        heights = normals @ hulls[:, 0].T
        for corner in range(1, hulls.shape[1]):
            np.maximum(heights, normals @ hulls[:, corner].T, out=heights)
        return self._behind(rays, heights, float(np.abs(hulls).max(initial=0)))

    def hides_own_hulls(self, rays: np.ndarray, hulls: np.ndarray) -> np.ndarray:
        """Return whether each ray's own hull of points (n, corners, 3) lies behind, shape (n,)."""
        heights = np.einsum("nca,na->nc", hulls, self.normals[rays]).max(axis=1, initial=-np.inf)
        return self._behind(rays, heights[:, np.newaxis], float(np.abs(hulls).max(initial=0)))[:, 0]

    def hides_ellipsoid(self, surface: Ellipsoid) -> np.ndarray:
        """Return whether an ellipsoid lies behind, for every ray, shape (N,)."""
        heights = self.normals @ surface.center + length(self.normals @ surface.axes)
        size = np.abs(surface.center).max() + np.abs(surface.axes).max()
        return self._behind(np.arange(len(heights)), heights[:, np.newaxis], float(size))[:, 0]

    def _behind(self, rays: np.ndarray, heights: np.ndarray, size: float) -> np.ndarray:
        offsets = self.offsets[rays, np.newaxis]
        slack = ROUNDING * (size + np.where(np.isfinite(offsets), np.abs(offsets), 0))
        return heights + offsets <= (slack if self.hides_touching else -slack)


def no_screens(count: int, *, hides_touching: bool) -> Screens:
    """Return screens that hide nothing, to be written into."""
    return Screens(normals=np.zeros((count, 3)), offsets=np.full(count, np.inf), hides_touching=hides_touching)


def flat_screen(apex: np.ndarray, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return normals and offsets of the planes through `points` (N, 3), with the apex in front."""
    with np.errstate(all="ignore"):
        units = normals / length(normals)[:, np.newaxis]
    units = units * np.where(dot(apex - points, units)[:, np.newaxis] < 0, -1.0, 1.0)
    return units, -dot(points, units)


def polar_screen(apex: np.ndarray, surface: Ellipsoid) -> tuple[np.ndarray, float]:
    """Return normal and offset of the polar plane of an apex outside the ellipsoid, with the apex in front."""
    normal = surface.to_unit.T @ (surface.to_unit @ (apex - surface.center))
    size = np.linalg.norm(normal)
    return normal / size, float(-(normal @ surface.center + 1) / size)
