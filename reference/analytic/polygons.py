"""Flat convex faces (triangles, squares, the faces of cubes): a ray hits where it passes all edges on the same side.

The side is the sign of the tetrahedron spanned by the rays' common apex, an edge and the ray's direction. An edge
that two faces share is taken in the same order by both, so that rounding cannot open a gap between them. Differences
of corners come first: the error is a few roundings of the distance, relative to the edge's length.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rayproof.reference.analytic.ends import Ends
from rayproof.reference.analytic.pencils import bundles
from rayproof.reference.analytic.vectors import cross, dot

BLOCK = 1 << 17  # faces or edges that are looked at together: what is made of them for one apex takes 100 MB at most


@dataclass(frozen=True, kw_only=True)
class Polygons:
    """Faces of equally many corners each; `numbers` are their indices in the scene, for none has zero area."""

    corners: np.ndarray  # (faces, corners, 3) m
    numbers: np.ndarray  # (faces,)
    closed: bool  # whether a face's edges belong to it

    @cached_property
    def normals(self) -> np.ndarray:
        """Return the faces' normals by winding, of any length, shape (faces, 3)."""
        return cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, -1] - self.corners[:, 0])

    def edge_normals(self, apex: np.ndarray, block: slice) -> np.ndarray:
        """Return the normals of the planes through the apex and each edge of some faces, shape (faces, corners, 3)."""
        start, end = self.corners[block], np.roll(self.corners[block], -1, axis=1)
        swap = later(start, end)[..., np.newaxis]
        lesser, greater = np.where(swap, end, start), np.where(swap, start, end)
        return cross(lesser - apex, greater - lesser) * np.where(swap, -1.0, 1.0)

    def meetings(self, apex: np.ndarray, directions: np.ndarray):
        """Yield (rays, faces, t (rays, faces)): t of apex + t directions on each face, NaN where it is missed.

        Pairs that are not yielded miss. A ray may be yielded more than once, each time with later faces.
        """
        for block in blocks(len(self.corners)):
            corners, edges, normals = self.corners[block], self.edge_normals(apex, block), self.normals[block]
            heights = dot(corners[:, 0] - apex, normals)
            for rays, faces in bundles(directions, corners - apex):
                # Not a matrix product: both faces of an edge must round alike, wherever they stand in memory.
                x, y, z = (directions[rays, axis, np.newaxis] for axis in range(3))
                least = greatest = np.zeros(0)
                for corner, normal in enumerate(np.moveaxis(edges[faces], 1, 0)):
                    volume = x * normal[:, 0] + y * normal[:, 1] + z * normal[:, 2]
                    least = np.minimum(least, volume) if corner else volume
                    greatest = np.maximum(greatest, volume) if corner else volume
                inside = (least >= 0) | (greatest <= 0) if self.closed else (least > 0) | (greatest < 0)
                with np.errstate(all="ignore"):
                    crossing = heights[faces] / (directions[rays] @ normals[faces].T)
                yield rays, faces + block.start, np.where(inside, crossing, np.nan)

    def first(
        self,
        apex: np.ndarray,
        directions: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        only: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the smallest crossing in the open interval (low, high), or inf, and its face's number.

        With `only` (N,), a face's number per ray, no other face is asked.
        """
        nearest, number = np.full(len(directions), np.inf), np.zeros(len(directions))
        for rays, faces, crossing in self.meetings(apex, directions):
            inside = (crossing > low[rays, np.newaxis]) & (crossing < high[rays, np.newaxis])
            if only is not None:
                inside &= self.numbers[faces] == only[rays, np.newaxis]
            crossing = np.where(inside, crossing, np.inf)
            best = crossing.argmin(axis=1)
            found = crossing[np.arange(len(rays)), best]
            nearer = found < nearest[rays]
            nearest[rays[nearer]], number[rays[nearer]] = found[nearer], self.numbers[faces[best[nearer]]]
        return nearest, number

    def blocks(
        self, apex: np.ndarray, segments: np.ndarray, ends: Ends, without: np.ndarray | None = None
    ) -> np.ndarray:
        """Return which segments from the apex meet a face strictly between their ends, shape (N,).

        `without` (N,) is the number of a face that cannot block its segment, for the segment ends on it.
        """
        blocked = np.zeros(len(segments), dtype=bool)
        for rays, faces, crossing in self.meetings(apex, segments):
            between = (crossing > 0) & (crossing < 1)
            if without is not None:
                between &= self.numbers[faces] != without[rays, np.newaxis]
            # A face that holds the segment's end, as a twin of the hit one does, is met there and not before.
            ray, face = np.nonzero(between & (crossing > 0.5))
            if len(ray):
                met = faces[face]
                between[ray, face] = ~ends[rays[ray]].lie_in(self.normals[met], self.corners[met, 0])
            blocked[rays] |= between.any(axis=1)
        return blocked


def blocks(count: int) -> Iterator[slice]:
    """Yield slices of at most `BLOCK` that cover `count` faces or edges."""
    for start in range(0, count, BLOCK):
        yield slice(start, min(start + BLOCK, count))


def later(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return where `start` comes after `end` in lexicographic order of coordinates."""
    after, decided = np.zeros(start.shape[:-1], dtype=bool), np.zeros(start.shape[:-1], dtype=bool)
    for axis in range(3):
        differs = ~decided & (start[..., axis] != end[..., axis])
        after |= differs & (start[..., axis] > end[..., axis])
        decided |= differs
    return after
