"""The edges of polygons, each once, with the faces that it borders."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cases.scene import Shape
from reference.analytic.polygons import Polygons, later
from reference.analytic.surfaces import surface_of
from reference.analytic.vectors import cross, dot


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
        normals = cross(self.starts - apex, self.ends - self.starts)
        corners = self.hulls.shape[1]
        one = dot(self.hulls[:, 2] - apex, normals)
        other = dot(self.hulls[:, (corners + 2) // 2] - apex, normals)
        covers_both_sides = (np.minimum(one, other) < 0) & (np.maximum(one, other) > 0)
        return ~(self.shared & covers_both_sides)


@lru_cache(maxsize=64)
def borders_of(shape: Shape) -> Borders:
    """Return the edges of a square, cube, triangle or mesh.

    Raises:
        TypeError: the shape has no edges.

    """
    surface = surface_of(shape)
    if not isinstance(surface, Polygons):
        raise TypeError(f"{type(shape).__name__} has no edges")
    starts, ends = surface.corners, np.roll(surface.corners, -1, axis=1)
    faces, count = starts.shape[:2]
    if faces == 0:
        nothing = np.zeros((0, 3))
        return Borders(starts=nothing, ends=nothing, hulls=np.zeros((0, 4, 3)), shared=np.zeros(0, dtype=bool))
    # The corners of the face that are not the edge's own, for every face and edge.
    rest = np.stack([np.roll(surface.corners, -step, axis=1) for step in range(2, count)], axis=2)
    starts, ends, rest = starts.reshape(-1, 3), ends.reshape(-1, 3), rest.reshape(-1, count - 2, 3)
    swap = later(starts, ends)[:, np.newaxis]
    keys = np.concatenate([np.where(swap, ends, starts), np.where(swap, starts, ends)], axis=1) + 0.0
    _, group, sizes = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(group.ravel(), kind="stable")
    shared = sizes[group.ravel()[order]] == 2
    pairs = order[shared].reshape(-1, 2)
    alone = order[~shared]
    first, second = np.concatenate([pairs[:, 0], alone]), np.concatenate([pairs[:, 1], alone])
    return Borders(
        starts=starts[first],
        ends=ends[first],
        hulls=np.concatenate([starts[first, np.newaxis], ends[first, np.newaxis], rest[first], rest[second]], axis=1),
        shared=np.arange(len(first)) < len(pairs),
    )
