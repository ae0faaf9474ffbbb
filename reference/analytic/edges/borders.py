"""The edges of polygons, each once, with the faces that it borders."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rayproof.cases.scene import Shape
from rayproof.reference.analytic.polygons import Polygons, blocks
from rayproof.reference.analytic.surfaces import surface_of
from rayproof.reference.analytic.vectors import cross, dot


@dataclass(frozen=True, kw_only=True)
class Borders:
    """Edges from `starts` to `ends` (E, 3) [m]; `hulls` (E, 2 k - 2, 3) hold all corners of the faces beside them."""

    starts: np.ndarray
    ends: np.ndarray
    hulls: np.ndarray
    shared: np.ndarray  # (E,) whether exactly two faces meet there

    def outlines_from(self, apex: np.ndarray) -> np.ndarray:
        """Return which edges can be part of the surface's outline as the apex sees it, shape (E,).

        Where an edge's two faces lie on its two sides, what the surface covers goes on across the edge.
        """
        return np.concatenate(
            [np.zeros(0, dtype=bool), *(self._outlines(apex, some) for some in blocks(len(self.shared)))]
        )

    def _outlines(self, apex: np.ndarray, some: slice) -> np.ndarray:
        starts, hulls = self.starts[some], self.hulls[some]
        normals = cross(starts - apex, self.ends[some] - starts)
        corners = hulls.shape[1]
        one = dot(hulls[:, 2] - apex, normals)
        other = dot(hulls[:, (corners + 2) // 2] - apex, normals)
        covers_both_sides = (np.minimum(one, other) < 0) & (np.maximum(one, other) > 0)
        return ~(self.shared[some] & covers_both_sides)


@lru_cache(maxsize=64)
def borders_of(shape: Shape) -> Borders:
    """Return the edges of a square, cube, triangle or mesh.

    Raises:
        TypeError: the shape has no edges.

    """
    surface = surface_of(shape)
    if not isinstance(surface, Polygons):
        raise TypeError(f"{type(shape).__name__} has no edges")
    faces, count = surface.corners.shape[:2]
    if faces == 0:
        nothing = np.zeros((0, 3))
        return Borders(starts=nothing, ends=nothing, hulls=np.zeros((0, 4, 3)), shared=np.zeros(0, dtype=bool))
    points = _numbered(surface.corners.reshape(-1, 3)).reshape(faces, count)
    following = np.roll(points, -1, axis=1)
    keys = np.minimum(points, following) * (faces * count) + np.maximum(points, following)
    del points, following
    _, group, sizes = np.unique(keys, return_inverse=True, return_counts=True)
    del keys
    order = np.argsort(group.ravel(), kind="stable")
    shared = sizes[group.ravel()[order]] == 2
    pairs = order[shared].reshape(-1, 2)
    alone = order[~shared]
    first, second = np.concatenate([pairs[:, 0], alone]), np.concatenate([pairs[:, 1], alone])
    # The edge's own two corners, then those of both faces that are not the edge's own.
    places = [(first, 0), (first, 1), *((half, step) for half in (first, second) for step in range(2, count))]
    hulls = np.empty((len(first), len(places), 3))
    for place, (half, step) in enumerate(places):
        hulls[:, place] = surface.corners[half // count, (half % count + step) % count]
    return Borders(starts=hulls[:, 0], ends=hulls[:, 1], hulls=hulls, shared=np.arange(len(first)) < len(pairs))


def _numbered(points: np.ndarray) -> np.ndarray:
    """Return a number for each of the points (N, 3), the same for equal ones, in lexicographic order, shape (N,)."""
    order = np.lexsort((points[:, 2], points[:, 1], points[:, 0]))
    new = np.zeros(len(points), dtype=bool)
    for axis in range(3):
        along = points[order, axis]
        new[1:] |= along[1:] != along[:-1]
    numbers = np.empty(len(points), dtype=np.int64)
    numbers[order] = np.cumsum(new)
    return numbers
