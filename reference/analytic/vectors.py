"""Vectors (..., 3) in NumPy: cross, dot, length, units; `Ends`, points with the size of their roundings.

Sums run from the first component to the last, as NumPy's do: the same bits. The judge has its own
(`reports.judge.answers`): a bug that both shared would hide itself.
"""

from dataclasses import dataclass

import numpy as np

# The error of a computed point's height over its surface, in roundings of the coordinates from which it is computed
# (the ray's foot 8, the crossing 8, the height itself 8, and as many again as a margin).
ON_SURFACE = 48 * 2.0**-53


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return cross products (..., 3)."""
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for axis, (first, second) in enumerate(((1, 2), (2, 0), (0, 1))):
        crossed = a[..., second] * b[..., first]
        np.subtract(a[..., first] * b[..., second], crossed, out=product[..., axis])
    return product


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return dot products (...) of vectors of any dimension."""
    products = a * b
    total = products[..., 0] + 0.0  # where NumPy begins: of negative zeros the sum is none
    for component in range(1, products.shape[-1]):
        total += products[..., component]
    return total


def length(vectors: np.ndarray) -> np.ndarray:
    """Return Euclidean lengths (...) of vectors of any dimension."""
    return np.sqrt(dot(vectors, vectors))


def units(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) scaled to unit length; scaled by a component first, so that no square overflows."""
    with np.errstate(all="ignore"):
        scaled = vectors / np.abs(vectors).max(axis=-1, keepdims=True)
        return scaled / length(scaled)[..., np.newaxis]


# Ends of shadow rays: points on the hit surface, and perhaps on others that coincide with it.
#
# The open segment from a point to a light meets no surface that contains the point (LIT-1): the root is 1, an end.
# Since float64 rounds that root up or down, such surfaces are recognised by the point's height over them.


@dataclass(frozen=True, kw_only=True)
class Ends:
    """Points (N, 3) [m] on surfaces, and the size (N, 3) [m] of the coordinates that they were computed from."""

    points: np.ndarray
    sizes: np.ndarray

    def __getitem__(self, rays: np.ndarray) -> "Ends":
        """Return some of the points."""
        return Ends(points=self.points[rays], sizes=self.sizes[rays])

    def lie_in(self, normals: np.ndarray, anchors: np.ndarray) -> np.ndarray:
        """Return whether each point is, within rounding, in its plane by normal (N, 3) and anchor (N or 1, 3)."""
        heights = np.abs(dot(self.points - anchors, normals))
        return heights <= ON_SURFACE * dot(np.abs(normals), self.sizes + np.abs(anchors))


def ends_of(eye: np.ndarray, positions: np.ndarray) -> Ends:
    """Return hit points (N, 3) [m] seen from the eye."""
    return Ends(points=positions, sizes=np.abs(eye) + np.abs(positions))
