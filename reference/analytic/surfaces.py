"""Rays against ellipsoids and polygons (`Ellipsoid`, `Polygons`): half chords, bundles, windings, outward normals.

Source: Euclid, Elements III.3 (the perpendicular from the centre bisects the chord) and Pythagoras. Nothing is
squared before it is subtracted: the error of a root is a few roundings of (distance + size), times the condition of
the map.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle
from rayproof.reference.analytic.vectors import ON_SURFACE, Ends, Flat, cross, dot, length


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


# Which rays of a pencil may meet which of many small pieces: rays are halved, pieces outside the halves' cones drop.
#
# All rays of a pencil start in one point (the eye, or a light), so a bundle of them lies between four planes through
# that point, and a piece wholly outside one of these planes is met by none. Nothing here decides a hit.


PAIRS = 1 << 16  # pairs of ray and piece handed out at once: a few megabytes of temporaries
FEW = 24  # pieces below which culling costs more than it saves
# Widens a bundle far beyond float64 roundings, far below a pixel.
SLACK = 1e-9


def bundles(
    directions: np.ndarray, pieces: np.ndarray, margins: np.ndarray | None = None
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield index arrays (rays, pieces) that together hold every pair which may meet.

    `directions` (N, 3) from the pencil's apex; `pieces` (K, corners, 3) relative to it, each the convex hull of its
    corners; `margins` (N,) are lengths by which each direction may be off.
    """
    if margins is None:
        margins = np.zeros(len(directions))
    waiting = [(np.arange(len(directions)), np.arange(len(pieces)))]
    while waiting:
        rays, kept = waiting.pop()
        if len(kept) > FEW and len(rays):
            kept = kept[_may_meet(directions[rays], margins[rays], pieces[kept])]
        if not len(kept) or not len(rays):
            continue
        if len(rays) * len(kept) <= PAIRS or len(rays) == 1:
            yield rays, kept
            continue
        waiting.extend((half, kept) for half in _halves(rays, directions))


def _halves(rays: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split rays at the median of the coordinate in which their directions differ most."""
    bundle = directions[rays]
    bundle = bundle / length(bundle)[:, np.newaxis]
    widest = np.argmax(np.ptp(bundle, axis=0))
    order = np.argpartition(bundle[:, widest], len(rays) // 2)
    return rays[order[: len(rays) // 2]], rays[order[len(rays) // 2 :]]


def _may_meet(directions: np.ndarray, margins: np.ndarray, pieces: np.ndarray) -> np.ndarray:
    """Return which pieces are not wholly outside one of the planes that bound the bundle, shape (K,)."""
    everything = np.ones(len(pieces), dtype=bool)
    lengths = length(directions)
    axis = (directions / lengths[:, np.newaxis]).mean(axis=0)
    if not np.linalg.norm(axis) > SLACK:
        return everything
    axis = axis / np.linalg.norm(axis)
    depths = directions @ axis
    if not np.all(depths - margins > 1e-2 * lengths):
        return everything
    first = cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    sides = (first, cross(axis, first))
    # One product for all corners of all pieces: as a stack of small ones it takes ten times as long.
    corner_depths, *both = (np.array([axis, *sides]) @ pieces.reshape(-1, 3).T).reshape(3, *pieces.shape[:2])
    outside = _all_corners(corner_depths < 0)
    signs = (-1, 1) if margins.any() else (0,)
    for side, corner_offsets in zip(sides, both, strict=True):
        offsets = directions @ side
        slopes = np.concatenate([(offsets + a * margins) / (depths + b * margins) for a in signs for b in signs])
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


BLOCK = 1 << 17  # faces or edges that are looked at together: what is made of them for one apex takes 100 MB at most


@dataclass(frozen=True, kw_only=True, eq=False)
class Polygons:
    """Faces of equally many corners each; `numbers` are their indices in the scene, for none has zero area."""

    corners: np.ndarray  # (faces, corners, 3) m
    numbers: np.ndarray  # (faces,)
    closed: bool  # whether a face's edges belong to it

    @cached_property
    def normals(self) -> np.ndarray:
        """Return the faces' normals by winding, of any length, shape (faces, 3)."""
        return cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, -1] - self.corners[:, 0])

    def meetings(self, apex: np.ndarray, directions: np.ndarray):
        """Yield (rays, faces, t (rays, faces)): t of apex + t directions on each face, NaN where it is missed.

        Pairs that are not yielded miss. A ray may be yielded more than once, each time with later faces.
        """
        for block in blocks(len(self.corners)):
            corners, edges, heights = _seen_from(self, apex.tobytes(), block.start, block.stop)
            for rays, faces in bundles(directions, corners):
                # Not a matrix product: both faces of an edge must round alike, wherever they stand in memory.
                x, y, z = (directions[rays, axis, np.newaxis] for axis in range(3))
                volumes = [x * a + y * b + z * c for a, b, c in edges[..., faces]]
                least, greatest = reduce(np.minimum, volumes), reduce(np.maximum, volumes)
                inside = (least >= 0) | (greatest <= 0) if self.closed else (least > 0) | (greatest < 0)
                with np.errstate(all="ignore"):
                    crossing = heights[faces] / (directions[rays] @ self.normals[block][faces].T)
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


# From the scene's shapes to implicit surfaces in world space, and their world normals (NRM-3).


Surface = Ellipsoid | Flat | Polygons

# Corners of the cube's faces by the bits of x, y, z (0: -0.5, 1: +0.5), going around each face.
CUBE_FACES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))


@lru_cache(maxsize=256)
def surface_of(shape: Shape) -> Surface:
    """Return the shape's surface in world space; raise TypeError for a kind of shape that is not known."""
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    linear, offset = matrix[:3, :3], matrix[:3, 3]
    if isinstance(shape, Sphere):
        axes = linear * shape.radius
        return Ellipsoid(
            center=linear @ np.asarray(shape.center) + offset, axes=axes, to_unit=np.linalg.inv(linear) / shape.radius
        )
    if isinstance(shape, Plane):
        return Flat(point=offset, normal=_units(np.linalg.inv(linear)[2]))
    if isinstance(shape, Square):
        corners = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
        return Polygons(corners=(corners @ linear.T + offset)[np.newaxis], numbers=np.zeros(1), closed=False)
    if isinstance(shape, Cube):
        bits = np.array([[(index >> axis) & 1 for axis in range(3)] for index in range(8)])
        corners = (bits - 0.5) @ linear.T + offset
        return Polygons(corners=corners[np.array(CUBE_FACES)], numbers=np.zeros(6), closed=True)
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).astype(np.float64)
        faces = Polygons(corners=corners, numbers=np.arange(len(corners)), closed=True)
        # A face without area is never hit, whether it had none before baking or lost it then.
        area = faces.normals.any(axis=1) & _winding_normals(shape).any(axis=1)
        return Polygons(corners=corners[area], numbers=np.flatnonzero(area), closed=True)
    raise TypeError(f"analytic knows no shape {type(shape).__name__}")


def outward_normals(shape: Shape, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return unit world normals (N, 3) at points (N, 3) [m] on the given faces (N,): never turned towards a viewer.

    A cube's face is the one whose object coordinate is greatest in magnitude; of equal ones x comes before y before z.
    """
    surface = surface_of(shape)
    if isinstance(surface, Ellipsoid):
        return _units(surface.normals(points))
    inverse = np.linalg.inv(np.asarray(shape.to_world, dtype=np.float64)[:3, :3])
    if isinstance(shape, Cube):
        local = cube_points(shape, points)
        axis = np.abs(local).argmax(axis=1)
        sign = np.where(np.take_along_axis(local, axis[:, np.newaxis], axis=1) < 0, -1.0, 1.0)
        return _units(inverse[axis] * sign)
    if isinstance(shape, Triangle | Mesh):
        winding = _winding_normals(shape)
        # A number that is no face's, or no number, comes from a renderer under test: any answer will show it.
        known = np.clip(np.nan_to_num(faces), 0, len(winding) - 1)
        return _units(winding[known.astype(int)] @ inverse)
    return np.broadcast_to(_units(inverse[2]), points.shape)


def cube_points(shape: Cube, points: np.ndarray) -> np.ndarray:
    """Return world points (N, 3) [m] in the cube's object space, where it is [-0.5, 0.5]^3."""
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    return (points - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T


@lru_cache(maxsize=64)
def _winding_normals(shape: Triangle | Mesh) -> np.ndarray:
    """Return object-space normals by winding, of any length, shape (faces, 3)."""
    if isinstance(shape, Triangle):
        corners = np.asarray(shape.vertices, dtype=np.float64)[np.newaxis]
    else:
        corners = shape.vertices.astype(np.float64)[shape.faces]
    return cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _units(vectors: np.ndarray) -> np.ndarray:
    """Return vectors scaled to unit length, along the last axis."""
    with np.errstate(all="ignore"):
        scaled = vectors / np.abs(vectors).max(axis=-1, keepdims=True)
        return scaled / length(scaled)[..., np.newaxis]
