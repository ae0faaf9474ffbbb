"""Float64 with error margins, before the balls: the surfaces that a ray or shadow ray surely misses."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from flint import arb, fmpq

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle
from rayproof.reference.certified.camera import ExactCamera, view_of
from rayproof.reference.certified.fields import Balls, exact, precision
from rayproof.reference.certified.light_paths import Suspects
from rayproof.reference.certified.numbers import Rational, cross, dot, minus
from rayproof.reference.certified.shapes import faces_of, placement_of, rational, winding_of
from rayproof.reference.certified.worlds import Surface

# Arrays of float64 numbers with rigorous error radii: they rule out most of a scene before any ball is computed.
#
# Source: Rump, "Fast and parallel interval arithmetic", BIT 39 (1999): midpoint and radius in rounding to nearest, with
# the radius's own roundings covered by a factor. A comparison with NaN or infinity is false, and so rules out nothing.


UNIT = 2.0**-52  # twice the unit roundoff
SAFE = 1 + 2.0**-45  # covers the roundings of a radius
TINY = 1e-300  # covers underflow


@dataclass(frozen=True)
class Margin:
    """A number whose exact value differs from `middle` by at most `radius`."""

    middle: np.ndarray
    radius: np.ndarray

    def __add__(self, other: "Margin") -> "Margin":
        middle = self.middle + other.middle
        return Margin(middle, (self.radius + other.radius + np.abs(middle) * UNIT) * SAFE)

    def __sub__(self, other: "Margin") -> "Margin":
        middle = self.middle - other.middle
        return Margin(middle, (self.radius + other.radius + np.abs(middle) * UNIT) * SAFE)

    def __mul__(self, other: "Margin") -> "Margin":
        middle = self.middle * other.middle
        size, other_size = np.abs(self.middle), np.abs(other.middle)
        spread = size * other.radius + self.radius * (other_size + other.radius)
        return Margin(middle, (spread + np.abs(middle) * UNIT) * SAFE + TINY)

    def __truediv__(self, other: "Margin") -> "Margin":
        middle = self.middle / other.middle
        size = np.abs(other.middle)
        spread = (self.radius + np.abs(middle) * other.radius) / (size - other.radius)
        radius = (spread + np.abs(middle) * UNIT) * SAFE + TINY
        return Margin(middle, np.where(size > other.radius * SAFE, radius, np.inf))

    def sqrt(self) -> "Margin":
        """Return the square root of numbers that are not negative."""
        positive = self.middle > self.radius
        middle = np.sqrt(np.where(positive, self.middle, 0))
        sure = (self.radius / middle + middle * UNIT) * SAFE
        return Margin(middle, np.where(positive, sure, np.sqrt(np.abs(self.middle) + self.radius) * SAFE + TINY))

    def __getitem__(self, index: object) -> "Margin":
        return Margin(self.middle[index], self.radius[index])  # pyright: ignore[reportArgumentType, reportCallIssue]

    @property
    def low(self) -> np.ndarray:
        """Return a lower bound."""
        return self.middle - self.radius * SAFE - np.abs(self.middle) * UNIT

    @property
    def high(self) -> np.ndarray:
        """Return an upper bound."""
        return self.middle + self.radius * SAFE + np.abs(self.middle) * UNIT

    def above(self) -> np.ndarray:
        """Return a mask: the value is surely positive."""
        return self.middle > self.radius

    def below(self) -> np.ndarray:
        """Return a mask: the value is surely negative."""
        return -self.middle > self.radius


def of(values: Sequence[fmpq | arb]) -> Margin:
    """Return exact numbers or balls as an array with margins."""
    middle = np.array([float(value if isinstance(value, arb) else arb(value)) for value in values])
    # A ball of 128 bits or more, of a rational number or a short computation, is far narrower than one rounding.
    return Margin(middle, np.abs(middle) * (2 * UNIT) + TINY)


def floats(values: np.ndarray) -> Margin:
    """Return float64 numbers, which are exact."""
    return Margin(values, np.zeros_like(values))


def products(rays: Margin, constants: Margin) -> Margin:
    """Return inner products (rays, surfaces) of rows (rays, 3) and (surfaces, 3), summed in any order."""
    size, constant_size = np.abs(rays.middle), np.abs(constants.middle)
    middle = rays.middle @ constants.middle.T
    # Three products and two sums, fused or not: at most gamma(3) of the sum of magnitudes.
    spread = (size + rays.radius) @ (constant_size * (4 * UNIT) + constants.radius).T + rays.radius @ constant_size.T
    return Margin(middle, spread * SAFE + TINY)


# Certain bounds of the t at which rays hit each face of a shape; one row per ray, one column per face.


@dataclass(frozen=True, kw_only=True)
class Reach:
    """Bounds of the first valid hit: t is at least `low` (inf: surely no hit) and at most `high` (inf: maybe no hit).

    NaN in `low` is no bound. A hit is valid if its t is in the `Span`.
    """

    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Span:
    """The interval low < t < high of valid hits; both ends (rays, 1) have margins, None: no upper end."""

    low: Margin
    high: Margin | None

    def surely_out(self, t_low: np.ndarray, t_high: np.ndarray) -> np.ndarray:
        """Return a mask (rays, faces): a t between these bounds is surely outside."""
        out = t_high <= self.low.low
        return out if self.high is None else out | (t_low >= self.high.high)

    def surely_in(self, t_low: np.ndarray, t_high: np.ndarray) -> np.ndarray:
        """Return a mask (rays, faces): a t between these bounds is surely inside."""
        inside = t_low > self.low.high
        return inside if self.high is None else inside & (t_high < self.high.low)


def reach(shape: Shape, apex: Rational, rays: Margin, span: Span) -> Reach:
    """Return the bounds for each face of a shape, seen from an exact apex along rays (N, 3)."""
    if isinstance(shape, Sphere):
        return _sphere(shape, apex, rays, span)
    if isinstance(shape, Cube):
        return _cube(shape, apex, rays, span)
    if isinstance(shape, Plane | Square):
        return _flat(shape, apex, rays, span)
    if isinstance(shape, Triangle | Mesh):
        return _triangles(shape, apex, rays, span)
    raise TypeError(f"certified knows no shape {type(shape).__name__}")


def _local(shape: Shape, apex: Rational, rays: Margin) -> tuple[Rational, Margin]:
    place = placement_of(shape)
    flat = of([value for row in place.inverse for value in row])
    matrix = Margin(flat.middle.reshape(3, 3), flat.radius.reshape(3, 3))
    return place.local(apex), products(rays, matrix)


def _sphere(shape: Sphere, apex: Rational, rays: Margin, span: Span) -> Reach:
    exact_start, along = _local(shape, apex, rays)
    start = of(exact_start)
    power = of([dot(exact_start, exact_start) - 1])
    x, y, z = (along[:, axis, np.newaxis] for axis in range(3))
    square = x * x + y * y + z * z
    half = x * start[0:1] + y * start[1:2] + z * start[2:3]
    discriminant = half * half - square * power
    root = discriminant.sqrt()
    low, high = np.full(square.middle.shape, np.inf), np.full(square.middle.shape, np.inf)
    nothing = floats(np.zeros(1))
    sure = discriminant.above()
    # The larger root first: the smaller root replaces it where it is inside the span.
    for t in ((root - half) / square, (nothing - half - root) / square):
        low = np.where(span.surely_out(t.low, t.high), low, t.low)
        high = np.where(span.surely_in(t.low, t.high) & sure, t.high, high)
    return Reach(low=np.where(discriminant.below(), np.inf, low), high=high)


def _flat(shape: Shape, apex: Rational, rays: Margin, span: Span) -> Reach:
    exact_start, along = _local(shape, apex, rays)
    start = of(exact_start)
    x, y, z = (along[:, axis, np.newaxis] for axis in range(3))
    t = (floats(np.zeros(1)) - start[2:3]) / z
    out, sure = span.surely_out(t.low, t.high), span.surely_in(t.low, t.high)
    if isinstance(shape, Square):
        half = floats(np.array([0.5]))
        for coordinate in (start[0:1] + t * x, start[1:2] + t * y):
            beyond, short = coordinate - half, coordinate + half
            out |= beyond.above() | short.below()
            sure &= beyond.below() & short.above()
    return Reach(low=np.where(out, np.inf, t.low), high=np.where(sure, t.high, np.inf))


def _cube(shape: Cube, apex: Rational, rays: Margin, span: Span) -> Reach:
    exact_start, along = _local(shape, apex, rays)
    start = of(exact_start)
    count = along.middle.shape[0]
    first_low, first_high = np.full(count, -np.inf), np.full(count, -np.inf)
    last_low, last_high = np.full(count, np.inf), np.full(count, np.inf)
    for axis in range(3):
        speed = along[:, axis]
        moving = speed.above() | speed.below()
        half = floats(np.where(speed.middle > 0, 0.5, -0.5))
        origin = start[axis : axis + 1]
        enter = (floats(np.zeros(1)) - half - origin) / speed
        leave = (half - origin) / speed
        # A nearly parallel ray gets no bound from this axis.
        first_low = np.maximum(first_low, np.where(moving, enter.low, -np.inf))
        first_high = np.maximum(first_high, np.where(moving, enter.high, np.inf))
        last_low = np.minimum(last_low, np.where(moving, leave.low, -np.inf))
        last_high = np.minimum(last_high, np.where(moving, leave.high, np.inf))
    missed, sure = first_low > last_high, first_high < last_low
    low, high = np.full((count, 1), np.inf), np.full((count, 1), np.inf)
    for least, greatest in ((last_low, last_high), (first_low, first_high)):
        bounds = least[:, np.newaxis], greatest[:, np.newaxis]
        low = np.where(span.surely_out(*bounds), low, bounds[0])
        high = np.where(span.surely_in(*bounds) & sure[:, np.newaxis], bounds[1], high)
    return Reach(low=np.where(missed[:, np.newaxis], np.inf, low), high=high)


def _triangles(shape: Triangle | Mesh, apex: Rational, rays: Margin, span: Span) -> Reach:
    by_determinant, by_u, by_v, height, empty = _cramer(shape, apex)
    determinant, u, v = (products(rays, constants) for constants in (by_determinant, by_u, by_v))
    rest = determinant - u - v
    above = u.above() | v.above() | rest.above()
    below = u.below() | v.below() | rest.below()
    inside = (u.above() & v.above() & rest.above()) | (u.below() & v.below() & rest.below())
    with np.errstate(all="ignore"):
        t = height / determinant
    out = (above & below) | span.surely_out(t.low, t.high) | empty
    return Reach(
        low=np.where(out, np.inf, t.low), high=np.where(inside & span.surely_in(t.low, t.high) & ~empty, t.high, np.inf)
    )


@lru_cache(maxsize=64)
def _cramer(shape: Triangle | Mesh, apex: Rational) -> tuple[Margin, Margin, Margin, Margin, np.ndarray]:
    """Return the constants of Cramer's rule per face, and a mask of faces without area.

    The first three are vectors; their inner products with the direction are the determinant, and u and v times the
    determinant. The fourth is the numerator of t. The mask has the faces whose area is exactly 0 in world or object
    space.
    """
    corners = world_triangles(shape).astype(np.float64)
    point = of(apex)
    first, second, third = (floats(corners[:, corner]) for corner in range(3))
    first_edge, second_edge = second - first, third - first
    to_apex = Margin(np.broadcast_to(point.middle, first.middle.shape), np.zeros_like(first.middle)) - first
    across = _cross(to_apex, first_edge)
    height = across[:, 0] * second_edge[:, 0] + across[:, 1] * second_edge[:, 1] + across[:, 2] * second_edge[:, 2]
    by_determinant = _cross(second_edge, first_edge)
    doubtful = ~(by_determinant.above() | by_determinant.below()).any(axis=1)
    empty = np.zeros(len(corners), dtype=bool)
    for face in np.flatnonzero(doubtful):
        a, b, c = (rational(corner) for corner in corners[face].tolist())
        empty[face] = not any(_exact_area(a, b, c))
    for face in np.flatnonzero(_flat_before(shape)):
        empty[face] |= not any(winding_of(shape, int(face)))
    return by_determinant, _cross(second_edge, to_apex), across, height, empty


def _flat_before(shape: Triangle | Mesh) -> np.ndarray:
    vertices = np.asarray(shape.vertices, dtype=np.float64)
    corners = vertices[np.newaxis] if isinstance(shape, Triangle) else vertices[shape.faces]
    area = _cross(floats(corners[:, 1]) - floats(corners[:, 0]), floats(corners[:, 2]) - floats(corners[:, 0]))
    return np.asarray(~(area.above() | area.below()).any(axis=1))


def _exact_area(a: Rational, b: Rational, c: Rational) -> Any:
    return cross(minus(b, a), minus(c, a))


def _cross(left: Margin, right: Margin) -> Margin:
    columns = []
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        columns.append(left[:, i] * right[:, j] - left[:, j] * right[:, i])
    return Margin(
        np.stack([column.middle for column in columns], axis=1), np.stack([column.radius for column in columns], axis=1)
    )


# Per image point: the surfaces that may be hit first, and those that may block each light.


CELLS = 400_000  # rays times faces that are computed at a time


def everything(scene: Scene) -> Suspects:
    """Return all surfaces, in the scene's order, for the hit and for every light."""
    surfaces = surfaces_of(scene)
    return Suspects(surfaces=surfaces, blockers=(surfaces,) * len(scene.lights))


def surfaces_of(scene: Scene) -> tuple[Surface, ...]:
    """Return (shape, face) of every surface, in the scene's order."""
    return tuple((index, face) for index, shape in enumerate(scene.shapes) for face in faces_of(shape))


def suspects(scene: Scene, points: np.ndarray, *, lights: bool) -> Iterator[Suspects]:
    """Yield the surfaces that each image point (N, 2) [px] may hit, and the possible blockers if `lights` is set."""
    surfaces = surfaces_of(scene)
    with precision(128):
        view = view_of(scene.camera, Balls(128))
    for part in _pieces(len(points), len(surfaces)):
        with np.errstate(all="ignore"):
            piece_suspects = list(_piece(scene, surfaces, view, points[part], lights=lights))
        yield from piece_suspects


def _piece(
    scene: Scene, surfaces: tuple[Surface, ...], view: ExactCamera, points: np.ndarray, *, lights: bool
) -> Iterator[Suspects]:
    directions = _directions(view, points)
    reaches = _all(scene, rational(scene.camera.eye), directions, _clip_span(scene, directions))
    nearest = reaches.high.min(axis=1, initial=np.inf)
    possible = ~(reaches.low > nearest[:, np.newaxis]) & (reaches.low != np.inf)
    if not lights or not scene.lights:
        yield from _told(surfaces, possible, [])
        return
    # If only one surface remains and it is surely hit, the hit point is accurate enough to filter the shadow rays.
    rows = np.flatnonzero((possible.sum(axis=1) == 1) & (nearest < np.inf))
    own = possible[rows].argmax(axis=1) if surfaces else np.zeros(0, dtype=int)
    low, high = reaches.low[rows, own], reaches.high[rows, own]
    radius = ((high - low) + np.abs(high) * UNIT) * SAFE
    t = Margin(low[:, np.newaxis], radius[:, np.newaxis])
    position = directions[rows] * t + of(rational(scene.camera.eye))
    blockers = []
    for light in range(len(scene.lights)):
        blocked, maybe = np.zeros(len(points), dtype=bool), np.ones_like(possible)
        blocked[rows], maybe[rows] = shadow_rays(scene, light, position, own)
        blockers.append((blocked, maybe))
    yield from _told(surfaces, possible, blockers)


def _told(
    surfaces: tuple[Surface, ...], possible: np.ndarray, blockers: list[tuple[np.ndarray, np.ndarray]]
) -> Iterator[Suspects]:
    """Yield the suspects of each row of the masks `possible` (rays, surfaces) and, per light, (blocked, maybe).

    Neighbouring pixels have the same suspects, so each combination is made once.
    """
    columns = [possible, *(part for blocked, maybe in blockers for part in (blocked[:, np.newaxis], maybe))]
    packed = np.packbits(np.concatenate(columns, axis=1), axis=1)
    width, made = packed.shape[1], {}
    keys = packed.tobytes()
    for row in range(len(packed)):
        key = keys[row * width : (row + 1) * width]
        if key not in made:
            lists = [
                None if blocked[row] else [surfaces[column] for column in np.flatnonzero(maybe[row])]
                for blocked, maybe in blockers
            ]
            hittable = [surfaces[column] for column in np.flatnonzero(possible[row])]
            made[key] = Suspects(surfaces=hittable, blockers=lists)
        yield made[key]


def shadow_rays(scene: Scene, light: int, position: Margin, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return masks of positions that another surface surely blocks (N,) and of surfaces that may block (N, surfaces).

    `own` (N,) is the column of the surface on which each position is.
    """
    source = rational(scene.lights[light].position)
    ends = Span(low=floats(np.zeros((1, 1))), high=floats(np.ones((1, 1))))
    reaches = _all(scene, source, position - of(source), ends)
    possible, sure = reaches.low != np.inf, reaches.high < np.inf
    itself = (np.arange(len(own)), own)
    possible[itself] = sure[itself] = False
    return np.asarray(sure.any(axis=1)), possible


def _directions(view: ExactCamera, points: np.ndarray) -> Margin:
    """Return directions of depth 1 (N, 3) with margins."""
    camera = view.camera
    size = floats(np.array([float(camera.width), float(camera.height)]))
    scaled = floats(np.asarray(points, dtype=np.float64) * 2) / size
    unity = floats(np.ones(1))
    x, y = scaled[:, :1] - unity, unity - scaled[:, 1:]
    right = of([axis * view.half_width for axis in view.right])
    up = of([axis * view.half_height for axis in view.up])
    return x * right + y * up + of(view.forward)


def _clip_span(scene: Scene, directions: Margin) -> Span:
    near, far = (of([exact(end)])[:, np.newaxis] for end in (scene.camera.near, scene.camera.far))
    if scene.clip == "none":
        return Span(low=floats(np.zeros((1, 1))), high=None)
    if scene.clip == "depth":
        return Span(low=near, high=far)
    x, y, z = (directions[:, axis, np.newaxis] for axis in range(3))
    length = (x * x + y * y + z * z).sqrt()
    return Span(low=near / length, high=far / length)


def _all(scene: Scene, apex: Rational, rays: Margin, span: Span) -> Reach:
    reaches = [reach(shape, apex, rays, span) for shape in scene.shapes]
    nothing = np.empty((len(rays.middle), 0))
    return Reach(
        low=np.concatenate([nothing, *(bounds.low for bounds in reaches)], axis=1),
        high=np.concatenate([nothing, *(bounds.high for bounds in reaches)], axis=1),
    )


def _lists(table: np.ndarray) -> list[list[int]]:
    """Return per row the columns that are true."""
    rows, columns = np.nonzero(table)
    ends = np.searchsorted(rows, np.arange(len(table) + 1)).tolist()
    numbers = columns.tolist()
    return [numbers[ends[row] : ends[row + 1]] for row in range(len(table))]


def hits_along(scene: Scene, directions: np.ndarray) -> Iterator[list[Surface]]:
    """Yield the surfaces that each direction (N, 3), of any length, may hit first from the eye."""
    surfaces = surfaces_of(scene)
    with precision(128) as field:
        forward = of(view_of(scene.camera, field).forward)
    for part in _pieces(len(directions), len(surfaces)):
        with np.errstate(all="ignore"):
            rays = floats(directions[part])
            reaches = _all(scene, rational(scene.camera.eye), rays, _given_span(scene, rays, forward))
            nearest = reaches.high.min(axis=1, initial=np.inf)
            possible = ~(reaches.low > nearest[:, np.newaxis]) & (reaches.low != np.inf)
        for columns in _lists(possible):
            yield [surfaces[column] for column in columns]


def lights_from(scene: Scene, positions: np.ndarray, objects: np.ndarray) -> list[list[list[Surface] | None]]:
    """Return per position (N, 3) [m] on its object (N, 2) and per light the possible blockers; None: surely blocked."""
    surfaces = surfaces_of(scene)
    numbers = {surface: column for column, surface in enumerate(surfaces)}
    own = np.array([numbers[int(shape), int(face)] for shape, face in objects.tolist()], dtype=int)
    answer: list[list[list[Surface] | None]] = []
    for part in _pieces(len(positions), len(surfaces)):
        with np.errstate(all="ignore"):
            masks = [
                shadow_rays(scene, light, floats(positions[part]), own[part]) for light in range(len(scene.lights))
            ]
            by_light = [(blocked, _lists(possible)) for blocked, possible in masks]
        answer += [
            [None if blocked[row] else [surfaces[column] for column in lists[row]] for blocked, lists in by_light]
            for row in range(len(positions[part]))
        ]
    return answer


def _given_span(scene: Scene, rays: Margin, forward: Margin) -> Span:
    if scene.clip == "none":
        return _clip_span(scene, rays)
    near, far = (of([exact(end)])[:, np.newaxis] for end in (scene.camera.near, scene.camera.far))
    if scene.clip == "shell":
        return Span(low=near, high=far)
    depth = products(rays, forward[np.newaxis, :])
    # No hit behind the eye is valid, and sideways directions have no bound; both are left to the balls.
    unknown = ~depth.above()
    low, high = near / depth, far / depth
    return Span(
        low=Margin(np.where(unknown, 0, low.middle), np.where(unknown, np.inf, low.radius)),
        high=Margin(np.where(unknown, 0, high.middle), np.where(unknown, np.inf, high.radius)),
    )


def _pieces(rays: int, faces: int) -> list[slice]:
    piece = max(1, CELLS // max(1, faces))
    return [slice(start, start + piece) for start in range(0, rays, piece)]
