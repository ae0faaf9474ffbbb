"""Infinite planes: the signed height over the plane changes linearly along a line."""

from dataclasses import dataclass

import numpy as np

from rayproof.reference.analytic.ends import Ends


@dataclass(frozen=True, kw_only=True)
class Flat:
    """World points x with normal . (x - point) = 0."""

    point: np.ndarray  # (3,) m
    normal: np.ndarray  # (3,) unit

    def crossing(self, apex: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return t of apex + t directions on the plane; not finite if parallel; shape (N,)."""
        with np.errstate(all="ignore"):
            return (self.normal @ (self.point - apex)) / (directions @ self.normal)

    def first(
        self, apex: np.ndarray, directions: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the crossing if it lies in the open interval (low, high), else inf, and the face, always 0."""
        root = self.crossing(apex, directions)
        return np.where((root > low) & (root < high), root, np.inf), np.zeros(len(root))

    def blocks(self, apex: np.ndarray, segments: np.ndarray, ends: Ends) -> np.ndarray:
        """Return which segments from the apex meet the plane strictly between their ends, shape (N,)."""
        root = self.crossing(apex, segments)
        lies_in_it = ends.lie_in(np.broadcast_to(self.normal, segments.shape), self.point)
        return (root > 0) & (root < 1) & ~lies_in_it
