"""Where feelers end: points that lie on the surface that was hit, and perhaps on others that coincide with it.

The open segment from a point to a light meets no surface that holds the point (LIT-1): its root is 1, an end. Float64
makes that root a rounding more or less, so that such surfaces are told by the point's height over them.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.reference.analytic.vectors import ON_SURFACE, dot


@dataclass(frozen=True, kw_only=True)
class Ends:
    """Points (N, 3) [m] on surfaces, and the size (N, 3) [m] of the coordinates that they were computed from."""

    points: np.ndarray
    sizes: np.ndarray

    def __getitem__(self, rays: np.ndarray) -> "Ends":
        """Return some of the points."""
        return Ends(points=self.points[rays], sizes=self.sizes[rays])

    def lie_in(self, normals: np.ndarray, anchors: np.ndarray) -> np.ndarray:
        """Return whether each point lies, within rounding, in its plane by normal (N, 3) and anchor (N or 1, 3)."""
        heights = np.abs(dot(self.points - anchors, normals))
        return heights <= ON_SURFACE * dot(np.abs(normals), self.sizes + np.abs(anchors))


def ends_of(eye: np.ndarray, positions: np.ndarray) -> Ends:
    """Return hit points (N, 3) [m] seen from the eye."""
    return Ends(points=positions, sizes=np.abs(eye) + np.abs(positions))
