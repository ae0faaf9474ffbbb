"""Edges of polygons and outlines of ellipsoids, seen from the eye or a light, and the distance to them [px]."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from rayproof.cases.scene import Shape
from rayproof.reference.analytic.camera import View
from rayproof.reference.analytic.edges.inverse_depths import Screens, Sheet, farthest, metric, no_sheet, reach
from rayproof.reference.analytic.surfaces import FEW, Ellipsoid, Polygons, blocks, bundles, surface_of
from rayproof.reference.analytic.vectors import cross, dot, length


@dataclass(frozen=True, kw_only=True)
class Borders:
    """Edges from `starts` to `ends` (E, 3) [m]; `hulls` (E, 2 k - 2, 3) hold all corners of the faces beside them."""

    starts: np.ndarray
    ends: np.ndarray
    hulls: np.ndarray
    shared: np.ndarray  # (E,) whether exactly two faces meet there

    def outlines_from(self, apex: np.ndarray, rounding: float = 0.0) -> np.ndarray:
        """Return which edges can be part of the surface's outline as the apex sees it, shape (E,).

        Where an edge's two faces lie on its two sides, what the surface covers goes on across the edge. A face whose
        plane holds the apex, up to a relative `rounding` of the coordinates, lies on either side.
        """
        parts = (self._outlines(apex, some, rounding) for some in blocks(len(self.shared)))
        return np.concatenate([np.zeros(0, dtype=bool), *parts])

    def _outlines(self, apex: np.ndarray, some: slice, rounding: float) -> np.ndarray:
        starts, hulls = self.starts[some], self.hulls[some]
        normals = cross(starts - apex, self.ends[some] - starts)
        corners = hulls.shape[1]
        one = dot(hulls[:, 2] - apex, normals)
        other = dot(hulls[:, (corners + 2) // 2] - apex, normals)
        slack = rounding * (np.abs(apex).max() + np.abs(hulls).max(initial=0)) * length(normals) if rounding else 0.0
        covers_both_sides = (np.minimum(one, other) < -slack) & (np.maximum(one, other) > slack)
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


# What an apex (the eye, or a light) sees of a pixel's point, as a function of the image point.
#
# Up to a positive factor the direction from the apex to the point eye + D(p) / w(p) is q(p) = w(p) (eye - apex) + D(p):
# linear in p where the point lies on a flat surface, and always where the apex is the eye.


@dataclass(frozen=True, kw_only=True)
class Sight:
    """The directions q (N, 3) from an apex, and how they change with the image point."""

    apex: np.ndarray  # (3,) m
    offset: np.ndarray  # (3,) m, eye - apex
    steps: np.ndarray  # (2, 3) change of D per pixel
    directions: np.ndarray  # (N, 3)
    sheet: Sheet  # of each ray, or one for all

    def jacobian(self) -> np.ndarray:
        """Return the change of q per pixel, shape (N, 2, 3), or (1, 2, 3) where it is the same for all."""
        return self.sheet.gradient[:, :, np.newaxis] * self.offset + self.steps

    def __getitem__(self, rays: np.ndarray) -> "Sight":
        """Return the sight of some of the rays."""
        sheet = self.sheet if len(self.sheet.value) == 1 else self.sheet[rays]
        return replace(self, directions=self.directions[rays], sheet=sheet)

    def linear(self, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return q.v and a lower bound [px] of the distance to its zero, for rays x vectors (K, 3): shapes (N, K)."""
        value = self.directions @ vectors.T
        lever, sheet = vectors @ self.offset, self.sheet
        across, down = (sheet.gradient[:, axis, np.newaxis] * lever + vectors @ self.steps[axis] for axis in range(2))
        bend = sheet.bend[:, np.newaxis] * np.abs(lever)
        return value, reach(value, np.hypot(across, down), bend, sheet.radius[:, np.newaxis])

    def caps(self, farthest: float) -> tuple[np.ndarray, np.ndarray]:
        """Return distances [px] up to `farthest` in which q changes moderately, and by how much there, both (N,)."""
        speed = np.linalg.norm(self.jacobian(), axis=(1, 2))
        lengths = length(self.directions)
        with np.errstate(all="ignore"):
            caps = np.minimum(farthest, np.minimum(self.sheet.radius, 0.25 * lengths / speed))
        swing = np.linalg.norm(self.offset) * self.sheet.bend * caps
        return caps, (speed + np.nan_to_num(swing)) * caps


def sight_from_eye(view: View, directions: np.ndarray) -> Sight:
    """Return how the eye sees the image points: q = D, whatever the surface."""
    return _sight(view.eye, view, directions, no_sheet(1))


def sight_from_light(source: np.ndarray, view: View, directions: np.ndarray, sheet: Sheet) -> Sight:
    """Return how a light at `source` [m] sees the points of a sheet."""
    seen = directions + sheet.value[:, np.newaxis] * (view.eye - source)
    return _sight(source, view, seen, sheet)


def _sight(apex: np.ndarray, view: View, directions: np.ndarray, sheet: Sheet) -> Sight:
    steps = np.stack([view.across, view.down])
    return Sight(apex=apex, offset=view.eye - apex, steps=steps, directions=directions, sheet=sheet)


# Distance in the image to the outline of a surface as an apex sees it: silhouettes from the eye, shadows from a light.
#
# An outline is a condition on the direction q from the apex alone. An edge is met where q lies in the fan that it spans
# with the apex: on one plane, and between two others. An ellipsoid's outline is a quadratic cone, of which one half
# counts.


# With this many edges hardly a pixel of theirs is farther than that from the nearest, and looking farther is slow.
MANY = 2000
FARTHEST_OF_MANY = 1.0  # px


def edge_distances(
    sight: Sight, borders: Borders, counted: np.ndarray, screens: Screens, covered: np.ndarray | None = None
) -> np.ndarray:
    """Return a lower bound [px] of the distance to the nearest counted (E,) edge that is not hidden, shape (N,).

    With many edges, those farther than a few pixels are not looked at, and that distance is returned instead.
    `covered` (N,) is lowered to the distance to the nearest that is not hidden in float32, unless another is nearer.
    """
    distances, margins = np.full(len(sight.directions), np.inf), np.zeros(len(sight.directions))
    many = int(np.count_nonzero(counted))
    if many > FEW:
        distances, margins = sight.caps(farthest(sight.steps) if many < MANY else FARTHEST_OF_MANY)
    lowest = [distances] if covered is None else [distances, covered]
    for some in blocks(len(counted)):
        numbers = some.start + np.flatnonzero(counted[some])
        _near_edges(sight, borders, numbers, screens, lowest, margins)
    return distances


def _near_edges(
    sight: Sight, borders: Borders, counted: np.ndarray, screens: Screens, lowest: list[np.ndarray], margins: np.ndarray
) -> None:
    """Lower distances (N,) to those of some edges, by their numbers; `margins` (N,) say how far is looked."""
    distances = lowest[0]
    starts, ends = borders.starts[counted] - sight.apex, borders.ends[counted] - sight.apex
    hulls = borders.hulls[counted]
    planes = cross(starts, ends - starts)
    # An edge on a line through the apex is seen as a point, which its neighbours end in.
    spread = planes.any(axis=1)
    starts, ends, hulls, planes = starts[spread], ends[spread], hulls[spread], planes[spread]
    from_start, from_end = cross(planes, starts), cross(ends, planes)
    for rays, edges in bundles(sight.directions, np.stack([starts, ends], axis=1), margins):
        part = sight[rays]
        _, near = part.linear(planes[edges])
        for side in (from_start, from_end):
            # Most edges of a mesh are too far already.
            left = np.flatnonzero((near < distances[rays, np.newaxis]).any(axis=0))
            edges, near = edges[left], near[:, left]
            value, distance = part.linear(side[edges])
            near = np.maximum(near, np.where(value < 0, distance, 0))
        left = np.flatnonzero((near < distances[rays, np.newaxis]).any(axis=0))
        hidden = screens.hides_hulls(rays, hulls[edges[left]])
        for found, behind in zip(lowest, hidden, strict=False):
            nearest = np.where(behind, np.inf, near[:, left]).min(axis=1, initial=np.inf)
            found[rays] = np.minimum(found[rays], nearest)


def ellipsoid_distances(sight: Sight, surface: Ellipsoid, screens: Screens) -> np.ndarray:
    """Return a lower bound [px] of the distance to an ellipsoid's outline, inf where it is hidden, shape (N,)."""
    start = surface.to_unit @ (sight.apex - surface.center)
    if np.linalg.norm(start) <= 1:
        return np.full(len(sight.directions), np.inf)
    along = sight.directions @ surface.to_unit.T
    offset = surface.to_unit @ sight.offset
    steps = sight.jacobian() @ surface.to_unit.T
    sheet = sight.sheet

    # Q and its derivatives by the chain rule: q changes by `steps`, and they by offset x (second derivative of w).
    crossed = cross(start, along)
    value = dot(along, along) - dot(crossed, crossed)
    gradient = 2 * (steps @ metric(start, along)[:, :, np.newaxis])[:, :, 0]
    bend = 2 * np.linalg.norm(metric(start, steps) @ steps.transpose(0, 2, 1), axis=(1, 2))
    if offset.any() and sheet.bend.any():
        radius = np.minimum(sheet.radius, farthest(sight.steps))
        bent_offset = metric(start, offset)
        with np.errstate(all="ignore"):
            swing = sheet.bend * radius
            drag = length(steps @ bent_offset)
            own = abs(bent_offset @ offset)
            bend = bend + 4 * drag * swing + 2 * own * swing**2
            bend += 2 * sheet.bend * (np.abs(along @ bent_offset) + drag * radius + own * swing * radius / 2)
    cone = reach(value, length(gradient), bend, sheet.radius)

    # Of the double cone only the half towards the ellipsoid counts.
    toward = -surface.to_unit.T @ start
    side, distance = sight.linear(toward[np.newaxis])
    distances = np.maximum(cone, np.where(side < 0, distance, 0)[:, 0])
    return np.where(screens.hides_ellipsoid(surface), np.inf, distances)
