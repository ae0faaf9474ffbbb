"""Ellipsoids: the unit sphere |y| = 1 under an affine map, cut by a line at its foot point plus or minus half a chord.

Source: Euclid, Elements III.3 (the perpendicular from the centre bisects the chord) and Pythagoras. Nothing is
squared before it is subtracted: the error of a root is a few roundings of (distance + size), times the condition of
the map.
"""

from dataclasses import dataclass

import numpy as np

from rayproof.reference.analytic.ends import Ends
from rayproof.reference.analytic.vectors import ON_SURFACE, dot, length


@dataclass(frozen=True, kw_only=True)
class Ellipsoid:
    """World points x with |to_unit (x - center)| = 1."""

    center: np.ndarray  # (3,) m
    axes: np.ndarray  # (3, 3) m: columns are the images of the unit sphere's axes
    to_unit: np.ndarray  # (3, 3) 1/m: inverse of `axes`

    def unit_points(self, points: np.ndarray) -> np.ndarray:
        """Return points (N, 3) [m] in the space where the surface is the unit sphere."""
        return (points - self.center) @ self.to_unit.T

    def crossings(self, apex: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return both roots, ascending, of apex + t directions on the surface; NaN without; shape (N, 2)."""
        start = self.to_unit @ (apex - self.center)
        with np.errstate(all="ignore"):
            along = directions @ self.to_unit.T
            speed = length(along)
            along = along / speed[:, np.newaxis]
            middle = -(along @ start)
            foot = length(start + middle[:, np.newaxis] * along)
            half_chord = np.sqrt((1 - foot) * (1 + foot))
            outer = middle + np.copysign(half_chord, middle)
            # The power of the apex is the product of the two roots; it gives the one that would cancel.
            power = (np.linalg.norm(start) - 1) * (np.linalg.norm(start) + 1)
            inner = np.where(outer == 0, outer, power / outer)
            return np.sort(np.stack([inner, outer], axis=1) / speed[:, np.newaxis], axis=1)

    def first(
        self, apex: np.ndarray, directions: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the smallest crossing in the open interval (low, high), or inf, and the face, always 0."""
        roots = self.crossings(apex, directions)
        inside = (roots > low[:, np.newaxis]) & (roots < high[:, np.newaxis])
        return np.where(inside, roots, np.inf).min(axis=1), np.zeros(len(roots))

    def blocks(self, apex: np.ndarray, segments: np.ndarray, ends: Ends) -> np.ndarray:
        """Return which segments from the apex meet the surface strictly between their ends, shape (N,)."""
        roots = self.crossings(apex, segments)
        blocked = np.any((roots > 0) & (roots < 1), axis=1)
        near = np.flatnonzero(blocked & (np.abs(roots - 1).min(axis=1) < 0.5))
        if len(near):
            points = ends.points[near]
            reach = (ends.sizes[near] + np.abs(self.center)) @ np.abs(self.to_unit).T
            held = np.abs(length(self.unit_points(points)) - 1) <= ON_SURFACE * length(reach)
            blocked[near[held]] = self.blocks_itself(apex, points[held])
        return blocked

    def blocks_itself(self, light: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return for points on the surface whether it lies between them and the light as well.

        The root at the point itself is divided out: the other one lies ahead of the point if the light is below its
        tangent plane, and before the light if the light is outside.
        """
        source = self.to_unit @ (light - self.center)
        on_sphere = self.unit_points(points)
        if np.linalg.norm(source) <= 1:
            return np.zeros(len(points), dtype=bool)
        return dot(on_sphere, source - on_sphere) < 0

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Return outward normals of any length: the gradient of |y|^2 / 2, shape (N, 3)."""
        return self.unit_points(points) @ self.to_unit
