"""Surfaces in world space (`Ellipsoid`, `Flat`, `Polygons`, `Box`): intersections with rays, shadows, normals.

Every kind of surface implements `meetings` by its own algebra: the intersections of rays from one point with its
pieces. A piece is smooth: a plane, one of a sphere's two crossings, a triangle, one of a cube's six faces. First hits,
coinciding surfaces and blockers follow from the meetings in the same way for every kind.

Sources: Euclid, Elements III.3 (the perpendicular from the centre bisects the chord) and Pythagoras. Numbers are
subtracted before they are squared: the error of a crossing is a few roundings of (distance + size), times the condition
of the matrix.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce
from typing import NamedTuple

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle
from rayproof.reference.analytic.vectors import ON_SURFACE, Ends, cross, dot, length, units


class Crossing(NamedTuple):
    """The meeting of each ray (N,) with a surface: t, inf for none; the face's number in the scene; the piece."""

    distance: np.ndarray
    face: np.ndarray
    piece: np.ndarray


Meetings = Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]
# The open interval of blockers as shares of a shadow ray's length, one for all rays or one for each (N,).
Between = tuple[np.ndarray | float, np.ndarray | float]


class Surface:
    """The base of surfaces: first hits, blockers and coinciding surfaces from intersections with rays of one point."""

    def meetings(self, apex: np.ndarray, directions: np.ndarray) -> Meetings:
        """Yield (rays (n,), pieces (k,), t (n, k)): t of apex + t directions on each piece, NaN for a miss.

        Pairs that are not yielded miss. A ray may be yielded more than once, each time with later pieces.
        """
        raise NotImplementedError

    def number(self, pieces: np.ndarray) -> np.ndarray:
        """Return the number in the scene of each piece's face: 0 except for triangles."""
        return np.zeros(np.shape(pieces))

    def outward(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return unit normals (N, 3) at points (N, 3) [m] on the given faces (N,), never turned towards a viewer."""
        raise NotImplementedError

    @property
    def faces(self) -> int:
        """Return the surface's number of faces in the scene."""
        return 1

    def planes(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return normals (N, 3), of any length and sign, of the surface itself at points (N, 3) [m] on faces (N,)."""
        return self.outward(points, faces)

    def middle(self, faces: np.ndarray) -> np.ndarray:
        """Return a point (N, 3) [m] of, or inside, each of the given faces (N,)."""
        raise NotImplementedError

    def pieces_at(self, points: np.ndarray, directions: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return the smooth piece of each point (N, 3) [m] at which a ray along `directions` hits a face (N,)."""
        return np.asarray(faces)

    def holds(self, piece: np.ndarray, ends: Ends) -> np.ndarray:
        """Return whether each end is, within rounding, on its piece (N,)."""
        raise NotImplementedError

    def blocks_own(self, apex: np.ndarray, segments: np.ndarray, ends: Ends, faces: np.ndarray) -> np.ndarray:
        """Return the mask (N,) of blocked segments from the apex to points on the surface itself; none if flat."""
        return np.zeros(len(segments), dtype=bool)

    def first(
        self,
        apex: np.ndarray,
        directions: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        only: np.ndarray | None = None,
    ) -> Crossing:
        """Return the smallest crossing in the open interval (low, high).

        With `only` (N,), a face's number per ray, all other faces are ignored.
        """
        nearest = _nothing(len(directions))
        for rays, pieces, crossing in self.meetings(apex, directions):
            inside = (crossing > low[rays, np.newaxis]) & (crossing < high[rays, np.newaxis])
            if only is not None:
                inside &= self.number(pieces) == only[rays, np.newaxis]
            key = np.where(inside, crossing, np.inf)
            best = key.argmin(axis=1)
            least = key[np.arange(len(rays)), best]
            nearer = least < nearest.distance[rays]
            self._put(nearest, rays[nearer], least[nearer], pieces[best[nearer]])
        return nearest

    def any_of(
        self, apex: np.ndarray, directions: np.ndarray, low: np.ndarray, high: np.ndarray, draw: np.random.Generator
    ) -> tuple[Crossing, np.ndarray]:
        """Return one of the crossings in the half-open interval (low, high] at random, and its draw from [0, 1).

        Without a crossing both are inf.
        """
        found, least = _nothing(len(directions)), np.full(len(directions), np.inf)
        for rays, pieces, crossing in self.meetings(apex, directions):
            inside = (crossing > low[rays, np.newaxis]) & (crossing <= high[rays, np.newaxis])
            if not inside.any():
                continue
            key = np.where(inside, draw.random(crossing.shape), np.inf)
            best, every = key.argmin(axis=1), np.arange(len(rays))
            chosen = key[every, best] < least[rays]
            least[rays[chosen]] = key[every, best][chosen]
            self._put(found, rays[chosen], crossing[every, best][chosen], pieces[best[chosen]])
        return found, least

    def _put(self, crossing: Crossing, rays: np.ndarray, distance: np.ndarray, pieces: np.ndarray) -> None:
        crossing.distance[rays], crossing.piece[rays] = distance, pieces
        crossing.face[rays] = self.number(pieces)

    def blocks(
        self,
        apex: np.ndarray,
        segments: np.ndarray,
        ends: Ends,
        between: Between = (0.0, 1.0),
        without: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the mask (N,) of the segments from the apex that meet the surface strictly between their ends.

        `between` are the shares of each segment, from the apex on, between which blockers count. `without` (N,) is the
        number of a face that cannot block its segment, because the segment ends on it.
        """
        blocked = np.zeros(len(segments), dtype=bool)
        low, high = (np.broadcast_to(share, len(segments)) for share in between)
        for rays, pieces, crossing in self.meetings(apex, segments):
            inside = (crossing > low[rays, np.newaxis]) & (crossing < high[rays, np.newaxis])
            if without is not None:
                inside &= self.number(pieces) != without[rays, np.newaxis]
            # A surface that contains the segment's end, such as one that coincides with the hit surface, meets the
            # segment there and not before, even if float64 rounds the crossing to a smaller t.
            ray, place = np.nonzero(inside & (crossing > 0.5))
            if len(ray):
                held = self.holds(pieces[place], ends[rays[ray]])
                inside[ray, place] = ~held | self.crossed_before_its_end(apex, ends[rays[ray]])
            blocked[rays] |= inside.any(axis=1)
        return blocked

    def crossed_before_its_end(self, apex: np.ndarray, ends: Ends) -> np.ndarray:
        """Return the mask (N,) of segments from the apex that meet the surface before their end on it; none if flat."""
        return np.zeros(len(ends.points), dtype=bool)


def _nothing(rays: int) -> Crossing:
    return Crossing(np.full(rays, np.inf), np.zeros(rays), np.zeros(rays, dtype=int))


@dataclass(frozen=True, kw_only=True)
class Flat(Surface):
    """World points x with normal . (x - point) = 0: the signed height over the plane changes linearly along a line."""

    point: np.ndarray  # (3,) m
    normal: np.ndarray  # (3,) unit

    def meetings(self, apex: np.ndarray, directions: np.ndarray) -> Meetings:
        """Yield the one crossing of each ray; not finite if parallel."""
        with np.errstate(all="ignore"):
            crossing = (self.normal @ (self.point - apex)) / (directions @ self.normal)
        yield np.arange(len(directions)), np.zeros(1, dtype=int), crossing[:, np.newaxis]

    def outward(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return the plane's normal."""
        return np.broadcast_to(self.normal, points.shape)

    def middle(self, faces: np.ndarray) -> np.ndarray:
        """Return the point that the plane is given by."""
        return np.broadcast_to(self.point, (len(faces), 3))

    def holds(self, piece: np.ndarray, ends: Ends) -> np.ndarray:
        """Return whether each end is in the plane."""
        return ends.lie_in(np.broadcast_to(self.normal, ends.points.shape), self.point)


@dataclass(frozen=True, kw_only=True)
class Ellipsoid(Surface):
    """World points x with |to_unit (x - center)| = 1. Its pieces are the nearer and the farther crossing of a ray."""

    center: np.ndarray  # (3,) m
    axes: np.ndarray  # (3, 3) m: columns are the images of the unit sphere's axes
    to_unit: np.ndarray  # (3, 3) 1/m: inverse of `axes`

    def unit_points(self, points: np.ndarray) -> np.ndarray:
        """Return points (N, 3) [m] in the space where the surface is the unit sphere."""
        return (points - self.center) @ self.to_unit.T

    def crossings(self, apex: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return both crossings, ascending, of apex + t directions with the surface; NaN without; shape (N, 2)."""
        start = self.to_unit @ (apex - self.center)
        with np.errstate(all="ignore"):
            along = directions @ self.to_unit.T
            speed = length(along)
            along = along / speed[:, np.newaxis]
            middle = -(along @ start)
            foot = length(start + middle[:, np.newaxis] * along)
            half_chord = np.sqrt((1 - foot) * (1 + foot))
            outer = middle + np.copysign(half_chord, middle)
            # The power of the apex is the product of the two roots; it gives the root that would suffer from
            # cancellation.
            power = (np.linalg.norm(start) - 1) * (np.linalg.norm(start) + 1)
            inner = np.where(outer == 0, outer, power / outer)
            return np.sort(np.stack([inner, outer], axis=1) / speed[:, np.newaxis], axis=1)

    def meetings(self, apex: np.ndarray, directions: np.ndarray) -> Meetings:
        """Yield both crossings of each ray."""
        yield np.arange(len(directions)), np.arange(2), self.crossings(apex, directions)

    def blocks_own(self, apex: np.ndarray, segments: np.ndarray, ends: Ends, faces: np.ndarray) -> np.ndarray:
        """Return for points on the surface whether it is also between them and the apex.

        The crossing at the point itself is divided out: the other one is ahead of the point if the apex is below its
        tangent plane, and before the apex if the apex is outside.
        """
        source = self.to_unit @ (apex - self.center)
        on_sphere = self.unit_points(ends.points)
        if np.linalg.norm(source) <= 1:
            return np.zeros(len(on_sphere), dtype=bool)
        return dot(on_sphere, source - on_sphere) < 0

    def crossed_before_its_end(self, apex: np.ndarray, ends: Ends) -> np.ndarray:
        """Return the mask of segments with an end on the surface that also meet it before."""
        return self.blocks_own(apex, ends.points, ends, np.zeros(len(ends.points)))

    def holds(self, piece: np.ndarray, ends: Ends) -> np.ndarray:
        """Return whether each end is on the surface."""
        reach = (ends.sizes + np.abs(self.center)) @ np.abs(self.to_unit).T
        return np.abs(length(self.unit_points(ends.points)) - 1) <= ON_SURFACE * length(reach)

    def outward(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return the direction of the gradient of |y|^2 / 2."""
        return units(self.unit_points(points) @ self.to_unit)

    def middle(self, faces: np.ndarray) -> np.ndarray:
        """Return the centre."""
        return np.broadcast_to(self.center, (len(faces), 3))

    def pieces_at(self, points: np.ndarray, directions: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return 0 where the ray enters the ellipsoid and 1 where it leaves."""
        return (dot(self.outward(points, faces), directions) > 0).astype(int)


# Culling of many small pieces for the rays of a pencil: rays are halved, and pieces outside the halves' cones are
# dropped.
#
# All rays of a pencil start in one point (the eye, or a light), so that a bundle of them is between four planes through
# that point, and none of them hits a piece that is wholly outside one of these planes. No hit is decided here.


PAIRS = 1 << 16  # pairs of ray and piece that are yielded at once: a few megabytes of temporaries
FEW = 24  # pieces below which culling costs more than it saves
# Widens a bundle far beyond float64 roundings, far below a pixel.
SLACK = 1e-9


def bundles(directions: np.ndarray, pieces: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield index arrays (rays, pieces) that together contain every pair which may meet.

    `directions` (N, 3) from the pencil's apex; `pieces` (K, corners, 3) relative to it, each the convex hull of its
    corners.
    """
    waiting = [(np.arange(len(directions)), np.arange(len(pieces)))]
    while waiting:
        rays, kept = waiting.pop()
        if len(kept) > FEW and len(rays):
            kept = kept[_may_meet(directions[rays], pieces[kept])]
        if not len(kept) or not len(rays):
            continue
        if len(rays) * len(kept) <= PAIRS or len(rays) == 1:
            yield rays, kept
            continue
        waiting.extend((half, kept) for half in _halves(rays, directions))


def _halves(rays: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split rays at the median of the coordinate with the largest spread of directions."""
    bundle = directions[rays]
    bundle = bundle / length(bundle)[:, np.newaxis]
    widest = np.argmax(np.ptp(bundle, axis=0))
    order = np.argpartition(bundle[:, widest], len(rays) // 2)
    return rays[order[: len(rays) // 2]], rays[order[len(rays) // 2 :]]


def _may_meet(directions: np.ndarray, pieces: np.ndarray) -> np.ndarray:
    """Return the mask (K,) of pieces that are not wholly outside one of the bundle's bounding planes."""
    everything = np.ones(len(pieces), dtype=bool)
    lengths = length(directions)
    axis = (directions / lengths[:, np.newaxis]).mean(axis=0)
    if not np.linalg.norm(axis) > SLACK:
        return everything
    axis = axis / np.linalg.norm(axis)
    depths = directions @ axis
    if not np.all(depths > 1e-2 * lengths):
        return everything
    first = cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    sides = (first, cross(axis, first))
    # One product for all corners of all pieces: as a stack of small ones it takes ten times as long.
    corner_depths, *side_depths = (np.array([axis, *sides]) @ pieces.reshape(-1, 3).T).reshape(3, *pieces.shape[:2])
    outside = _all_corners(corner_depths < 0)
    for side, corner_offsets in zip(sides, side_depths, strict=True):
        slopes = directions @ side / depths
        low, high = slopes.min(), slopes.max()
        low, high = low - SLACK * (1 + abs(low)), high + SLACK * (1 + abs(high))
        outside |= _all_corners(corner_offsets < low * corner_depths)
        outside |= _all_corners(corner_offsets > high * corner_depths)
    return ~outside


def _all_corners(mask: np.ndarray) -> np.ndarray:
    """Return mask.all(axis=1), much faster along so short an axis."""
    result = mask[:, 0]
    for corner in range(1, mask.shape[1]):
        result = result & mask[:, corner]
    return result


# Flat convex faces (triangles, squares, the faces of cubes): a ray hits where it passes all edges on the same side.
#
# The side is the sign of the tetrahedron spanned by the rays' common apex, an edge and the ray's direction. An edge
# that two faces share is taken in the same order by both, so that rounding cannot open a gap between them. Differences
# of corners come first: the error is a few roundings of the distance, relative to the edge's length.


BLOCK = 1 << 17  # faces that are processed together: their arrays for one apex take at most 100 MB


@dataclass(frozen=True, kw_only=True, eq=False)
class Polygons(Surface):
    """Faces with the same number of corners, without faces of zero area; each is a piece."""

    corners: np.ndarray  # (pieces, corners, 3) m
    numbers: np.ndarray  # (pieces,): the faces' indices in the scene
    closed: bool  # whether a face's edges belong to it
    face_normals: np.ndarray  # (faces in the scene, 3): unit, by the specification

    @cached_property
    def normals(self) -> np.ndarray:
        """Return the pieces' normals by winding, of any length, shape (pieces, 3)."""
        return cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, -1] - self.corners[:, 0])

    def number(self, pieces: np.ndarray) -> np.ndarray:
        """Return the indices in the scene."""
        return self.numbers[pieces]

    def meetings(self, apex: np.ndarray, directions: np.ndarray) -> Meetings:
        """Yield the crossings of rays with the faces near them."""
        for block in blocks(len(self.corners)):
            corners, edges, heights = _seen_from(self, apex.tobytes(), block.start, block.stop)
            for rays, faces in bundles(directions, corners):
                # Not a matrix product, whose rounding may depend on the place in memory: both faces of an edge must
                # round alike.
                x, y, z = (directions[rays, axis, np.newaxis] for axis in range(3))
                volumes = [x * a + y * b + z * c for a, b, c in edges[..., faces]]
                least, greatest = reduce(np.minimum, volumes), reduce(np.maximum, volumes)
                inside = (least >= 0) | (greatest <= 0) if self.closed else (least > 0) | (greatest < 0)
                with np.errstate(all="ignore"):
                    crossing = heights[faces] / (directions[rays] @ self.normals[block][faces].T)
                yield rays, faces + block.start, np.where(inside, crossing, np.nan)

    def holds(self, piece: np.ndarray, ends: Ends) -> np.ndarray:
        """Return whether each end is in its face's plane."""
        return ends.lie_in(self.normals[piece], self.corners[piece, 0])

    def blocks_own(self, apex: np.ndarray, segments: np.ndarray, ends: Ends, faces: np.ndarray) -> np.ndarray:
        """Return the mask of the segments from the apex that another face blocks."""
        if len(self.corners) < 2:
            return np.zeros(len(segments), dtype=bool)
        return self.blocks(apex, segments, ends, without=faces)

    def outward(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return the faces' normals."""
        return self.face_normals[self._known(faces)]

    @property
    def faces(self) -> int:
        """Return the number of faces in the scene."""
        return len(self.face_normals)

    def planes(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return the faces' normals by their corners in the world."""
        return self.normals[self.pieces_at(points, points, faces)] if len(self.corners) else self.outward(points, faces)

    def middle(self, faces: np.ndarray) -> np.ndarray:
        """Return the mean of each face's corners."""
        return self.corners[self.pieces_at(faces, faces, faces)].mean(axis=1)

    def pieces_at(self, points: np.ndarray, directions: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return the piece of each face; an arbitrary piece for faces without area."""
        return np.searchsorted(self.numbers, np.nan_to_num(faces)).clip(0, len(self.corners) - 1)

    def _known(self, faces: np.ndarray) -> np.ndarray:
        # The renderer under test may write NaN, or numbers of faces that do not exist: any answer shows the error.
        return np.clip(np.nan_to_num(faces), 0, len(self.face_normals) - 1).astype(int)


@dataclass(frozen=True, kw_only=True, eq=False)
class Box(Polygons):
    """A cube's six faces, each a piece; they are one face of the scene."""

    to_object: np.ndarray  # (3, 3) 1/m: into the space where the box is [-0.5, 0.5]^3, from its centre
    center: np.ndarray  # (3,) m

    def object_points(self, points: np.ndarray) -> np.ndarray:
        """Return world points (N, 3) [m] in object space."""
        return (points - self.center) @ self.to_object.T

    def _sides(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the axis (N,) of the coordinate of greatest magnitude and its sign; of equal ones x, y, z in order."""
        local = self.object_points(points)
        axis = np.abs(local).argmax(axis=1)
        return axis, np.where(np.take_along_axis(local, axis[:, np.newaxis], axis=1)[:, 0] < 0, -1.0, 1.0)

    def outward(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return the normal of the face whose object coordinate is greatest in magnitude."""
        axis, sign = self._sides(points)
        return units(self.to_object[axis] * sign[:, np.newaxis])

    def middle(self, faces: np.ndarray) -> np.ndarray:
        """Return the centre."""
        return np.broadcast_to(self.center, (len(faces), 3))

    def pieces_at(self, points: np.ndarray, directions: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return the face in the order of `CUBE_FACES`."""
        axis, sign = self._sides(points)
        return 2 * axis + (sign > 0)

    def first(
        self,
        apex: np.ndarray,
        directions: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        only: np.ndarray | None = None,
    ) -> Crossing:
        """Return the smallest crossing in the open interval (low, high), on the face whose normal it has."""
        return self._by_place(super().first(apex, directions, low, high, only), apex, directions)

    def any_of(
        self, apex: np.ndarray, directions: np.ndarray, low: np.ndarray, high: np.ndarray, draw: np.random.Generator
    ) -> tuple[Crossing, np.ndarray]:
        """Return one of the crossings in the half-open interval (low, high], on the face with its normal."""
        crossing, least = super().any_of(apex, directions, low, high, draw)
        return self._by_place(crossing, apex, directions), least

    def _by_place(self, crossing: Crossing, apex: np.ndarray, directions: np.ndarray) -> Crossing:
        # Where two faces meet, the place of a crossing on either may be nearer to the other, whose normal it then has.
        hit = np.flatnonzero(np.isfinite(crossing.distance))
        points = apex + crossing.distance[hit, np.newaxis] * directions[hit]
        crossing.piece[hit] = self.pieces_at(points, directions[hit], crossing.face[hit])
        return crossing

    def blocks_own(self, apex: np.ndarray, segments: np.ndarray, ends: Ends, faces: np.ndarray) -> np.ndarray:
        """Return whether the box is between points on it and the apex.

        The rest of the box is below each of its faces: it blocks a light that is below the face as well, but not
        inside.
        """
        axis, sign = self._sides(ends.points)
        source = self.object_points(apex[np.newaxis])[0]
        return np.logical_and(sign * source[axis] < 0.5, np.abs(source).max() > 0.5)


@lru_cache(maxsize=8)
def _seen_from(faces: Polygons, place: bytes, start: int, stop: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return faces' corners from an apex, normals (corners, 3, faces) of its planes with their edges, its heights."""
    apex, first = np.frombuffer(place), faces.corners[start:stop]
    following = np.roll(first, -1, axis=1)
    swap = later(first, following)[..., np.newaxis]
    lesser, greater = np.where(swap, following, first), np.where(swap, first, following)
    edges = cross(lesser - apex, greater - lesser) * np.where(swap, -1.0, 1.0)
    heights = dot(first[:, 0] - apex, faces.normals[start:stop])
    return first - apex, np.ascontiguousarray(np.moveaxis(edges, 0, -1)), heights


def blocks(count: int) -> Iterator[slice]:
    """Yield slices of at most `BLOCK` that cover `count` faces."""
    for start in range(0, count, BLOCK):
        yield slice(start, min(start + BLOCK, count))


def later(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the mask of the pairs whose `start` is after `end` in lexicographic order of coordinates."""
    after, decided = np.zeros(start.shape[:-1], dtype=bool), np.zeros(start.shape[:-1], dtype=bool)
    for axis in range(3):
        differs = ~decided & (start[..., axis] != end[..., axis])
        after |= differs & (start[..., axis] > end[..., axis])
        decided |= differs
    return after


# From the scene's shapes to surfaces in world space, and their world normals (NRM-3).


# Corners of the cube's faces by the bits of x, y, z (0: -0.5, 1: +0.5), going around each face: -x, +x, -y, +y, -z, +z.
CUBE_FACES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
SQUARE = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])


def _ellipsoid(shape: Sphere, linear: np.ndarray, offset: np.ndarray) -> Surface:
    return Ellipsoid(
        center=linear @ np.asarray(shape.center) + offset,
        axes=linear * shape.radius,
        to_unit=np.linalg.inv(linear) / shape.radius,
    )


def _plane(shape: Plane, linear: np.ndarray, offset: np.ndarray) -> Surface:
    return Flat(point=offset, normal=units(np.linalg.inv(linear)[2]))


def _square(shape: Square, linear: np.ndarray, offset: np.ndarray) -> Surface:
    normal = units(np.linalg.inv(linear)[2])
    corners = (SQUARE @ linear.T + offset)[np.newaxis]
    return Polygons(corners=corners, numbers=np.zeros(1), closed=False, face_normals=normal[np.newaxis])


def _cube(shape: Cube, linear: np.ndarray, offset: np.ndarray) -> Surface:
    bits = np.array([[(index >> axis) & 1 for axis in range(3)] for index in range(8)])
    corners, inverse = (bits - 0.5) @ linear.T + offset, np.linalg.inv(linear)
    return Box(
        corners=corners[np.array(CUBE_FACES)], numbers=np.zeros(6), closed=True, face_normals=units(inverse[:1]),
        to_object=inverse, center=offset,
    )  # fmt: skip


def _triangles(shape: Triangle | Mesh, linear: np.ndarray, offset: np.ndarray) -> Surface:
    corners, winding = world_triangles(shape).astype(np.float64), _winding_normals(shape)
    normals = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # A face without area is never hit, whether it had none before baking or lost it then.
    area = normals.any(axis=1) & winding.any(axis=1)
    return Polygons(
        corners=corners[area], numbers=np.flatnonzero(area), closed=True,
        face_normals=units(winding @ np.linalg.inv(linear)),
    )  # fmt: skip


# To add a shape: a surface, and a line here. No other part of the oracle or the judge depends on kinds of shapes.
SURFACES: dict[type[Shape], Callable[..., Surface]] = {
    Sphere: _ellipsoid,
    Plane: _plane,
    Square: _square,
    Cube: _cube,
    Triangle: _triangles,
    Mesh: _triangles,
}


@lru_cache(maxsize=256)
def surface_of(shape: Shape) -> Surface:
    """Return the shape's surface in world space; raise TypeError for a kind of shape that is not known."""
    make = SURFACES.get(type(shape))
    if make is None:
        raise TypeError(f"analytic knows no shape {type(shape).__name__}")
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    return make(shape, matrix[:3, :3], matrix[:3, 3])


def _winding_normals(shape: Triangle | Mesh) -> np.ndarray:
    """Return object-space normals by winding, of any length, shape (faces, 3)."""
    if isinstance(shape, Triangle):
        corners = np.asarray(shape.vertices, dtype=np.float64)[np.newaxis]
    else:
        corners = shape.vertices.astype(np.float64)[shape.faces]
    return cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
