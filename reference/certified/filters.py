"""Float64 with error margins, ahead of the balls: which surfaces a ray or shadow ray surely misses."""

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

# Arrays of float64 numbers with rigorous error radii: they rule out most of a scene before a ball is spent on it.
#
# Source: Rump, "Fast and parallel interval arithmetic", BIT 39 (1999): midpoint and radius in rounding to nearest, with
# the radius's own roundings covered by a factor. A comparison with NaN or infinity tells nothing: it rules out nothing.


UNIT = 2.0**-52  # twice the unit roundoff
SAFE = 1 + 2.0**-45  # covers the roundings of a radius
TINY = 1e-300  # covers underflow


@dataclass(frozen=True)
class Margin:
    """The exact value lies within `radius` of `middle`."""

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
        """Return the square root of what is known not to be negative."""
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
        """Return where the value is surely positive."""
        return self.middle > self.radius

    def below(self) -> np.ndarray:
        """Return where the value is surely negative."""
        return -self.middle > self.radius


def of(values: Sequence[fmpq | arb]) -> Margin:
    """Return exact numbers or balls as an array with margins."""
    middle = np.array([float(value if isinstance(value, arb) else arb(value)) for value in values])
    # A ball of 128 bits or more that came from a rational or a short computation is far narrower than one rounding.
    return Margin(middle, np.abs(middle) * (2 * UNIT) + TINY)


def floats(values: np.ndarray) -> Margin:
    """Return float64 numbers, which are exact."""
    return Margin(values, np.zeros_like(values))


def products(rays: Margin, constants: Margin) -> Margin:
    """Return inner products (rays, surfaces) of rows (rays, 3) and (surfaces, 3), summed in any order."""
    size, other = np.abs(rays.middle), np.abs(constants.middle)
    middle = rays.middle @ constants.middle.T
    # Three products and two sums, fused or not: at most gamma(3) of the sum of magnitudes.
    spread = (size + rays.radius) @ (other * (4 * UNIT) + constants.radius).T + rays.radius @ other.T
    return Margin(middle, spread * SAFE + TINY)


# How far along many rays each face of a shape is hit, as certain bounds; one row per ray, one column per face.


@dataclass(frozen=True, kw_only=True)
class Reach:
    """No hit that counts lies below `low` (inf: surely none); one surely counts at or below `high` (inf: maybe none).

    NaN in `low` is no bound.
    """

    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Span:
    """Hits count where low < t < high; both ends (rays, 1) with margins, None: no upper end."""

    low: Margin
    high: Margin | None

    def surely_out(self, t_low: np.ndarray, t_high: np.ndarray) -> np.ndarray:
        """Return where a t between these bounds surely does not count, (rays, faces)."""
        out = t_high <= self.low.low
        return out if self.high is None else out | (t_low >= self.high.high)

    def surely_in(self, t_low: np.ndarray, t_high: np.ndarray) -> np.ndarray:
        """Return where a t between these bounds surely counts, (rays, faces)."""
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
    # From the larger root to the smaller: the smaller one overrides where it counts.
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
        known = speed.above() | speed.below()
        half = floats(np.where(speed.middle > 0, 0.5, -0.5))
        origin = start[axis : axis + 1]
        enter = (floats(np.zeros(1)) - half - origin) / speed
        leave = (half - origin) / speed
        # Nearly parallel: no bound either way.
        first_low = np.maximum(first_low, np.where(known, enter.low, -np.inf))
        first_high = np.maximum(first_high, np.where(known, enter.high, np.inf))
        last_low = np.minimum(last_low, np.where(known, leave.low, -np.inf))
        last_high = np.minimum(last_high, np.where(known, leave.high, np.inf))
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
    """Return what the determinant, u, v and t are made of, per face, and which faces surely or maybe have no area."""
    corners = world_triangles(shape).astype(np.float64)
    point = of(apex)
    first, second, third = (floats(corners[:, corner]) for corner in range(3))
    one, two = second - first, third - first
    to_apex = Margin(np.broadcast_to(point.middle, first.middle.shape), np.zeros_like(first.middle)) - first
    across = _cross(to_apex, one)
    height = across[:, 0] * two[:, 0] + across[:, 1] * two[:, 1] + across[:, 2] * two[:, 2]
    by_determinant = _cross(two, one)
    doubtful = ~(by_determinant.above() | by_determinant.below()).any(axis=1)
    empty = np.zeros(len(corners), dtype=bool)
    for face in np.flatnonzero(doubtful):
        a, b, c = (rational(corner) for corner in corners[face].tolist())
        empty[face] = not any(_exact_area(a, b, c))
    for face in np.flatnonzero(_flat_before(shape)):
        empty[face] |= not any(winding_of(shape, int(face)))
    return by_determinant, _cross(two, to_apex), across, height, empty


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


# For every image point: the surfaces that may be hit first, and those that may block each light.


CELLS = 400_000  # rays times faces in one piece


def everything(scene: Scene) -> Suspects:
    """Return all surfaces, in the scene's order, for the hit and for every light."""
    surfaces = surfaces_of(scene)
    return Suspects(surfaces=surfaces, blockers=(surfaces,) * len(scene.lights))


def surfaces_of(scene: Scene) -> tuple[Surface, ...]:
    """Return (shape, face) of every surface, in the scene's order."""
    return tuple((index, face) for index, shape in enumerate(scene.shapes) for face in faces_of(shape))


def suspects(scene: Scene, points: np.ndarray, *, lights: bool) -> Iterator[Suspects]:
    """Yield what may matter to each image point (N, 2) [px]; without `lights` nothing about them."""
    surfaces = surfaces_of(scene)
    with precision(128):
        view = view_of(scene.camera, Balls(128))
    for part in _pieces(len(points), len(surfaces)):
        with np.errstate(all="ignore"):
            found = list(_piece(scene, surfaces, view, points[part], lights=lights))
        yield from found


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
    # Where one surface alone is left, and surely hit, the hit point is known well enough to filter the shadow rays.
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
    """Yield each row's suspects: of the surfaces `possible` (rays, surfaces), and per light what blocks or may block.

    Neighbouring pixels suspect the same, so each combination is made once.
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
            mine = [surfaces[column] for column in np.flatnonzero(possible[row])]
            made[key] = Suspects(surfaces=mine, blockers=lists)
        yield made[key]


def shadow_rays(scene: Scene, light: int, position: Margin, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which positions are surely blocked by another surface (N,), and which surfaces may block (N, surfaces)."""
    source = rational(scene.lights[light].position)
    ends = Span(low=floats(np.zeros((1, 1))), high=floats(np.ones((1, 1))))
    found = _all(scene, source, position - of(source), ends)
    possible, sure = found.low != np.inf, found.high < np.inf
    mine = (np.arange(len(own)), own)
    possible[mine] = sure[mine] = False
    return np.asarray(sure.any(axis=1)), possible


def _directions(view: ExactCamera, points: np.ndarray) -> Margin:
    """Return directions of depth 1 (N, 3) with margins."""
    camera = view.camera
    size = floats(np.array([float(camera.width), float(camera.height)]))
    scaled = floats(np.asarray(points, dtype=np.float64) * 2) / size
    one = floats(np.ones(1))
    x, y = scaled[:, :1] - one, one - scaled[:, 1:]
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
    found = [reach(shape, apex, rays, span) for shape in scene.shapes]
    nothing = np.empty((len(rays.middle), 0))
    return Reach(
        low=np.concatenate([nothing, *(one.low for one in found)], axis=1),
        high=np.concatenate([nothing, *(one.high for one in found)], axis=1),
    )


def _lists(table: np.ndarray) -> list[list[int]]:
    """Return the columns where each row is true."""
    rows, columns = np.nonzero(table)
    ends = np.searchsorted(rows, np.arange(len(table) + 1)).tolist()
    numbers = columns.tolist()
    return [numbers[ends[row] : ends[row + 1]] for row in range(len(table))]


def hits_along(scene: Scene, directions: np.ndarray) -> Iterator[list[Surface]]:
    """Yield the surfaces that each direction (N, 3), of whatever length, may hit first from the eye."""
    surfaces = surfaces_of(scene)
    with precision(128) as field:
        forward = of(view_of(scene.camera, field).forward)
    for part in _pieces(len(directions), len(surfaces)):
        with np.errstate(all="ignore"):
            rays = floats(directions[part])
            found = _all(scene, rational(scene.camera.eye), rays, _given_span(scene, rays, forward))
            nearest = found.high.min(axis=1, initial=np.inf)
            possible = ~(found.low > nearest[:, np.newaxis]) & (found.low != np.inf)
        for columns in _lists(possible):
            yield [surfaces[column] for column in columns]


def lights_from(scene: Scene, positions: np.ndarray, objects: np.ndarray) -> list[list[list[Surface] | None]]:
    """Return for each position (N, 3) [m] on its object (N, 2), per light, what may block it; None: surely blocked."""
    surfaces = surfaces_of(scene)
    numbers = {surface: column for column, surface in enumerate(surfaces)}
    own = np.array([numbers[int(shape), int(face)] for shape, face in objects.tolist()], dtype=int)
    answer: list[list[list[Surface] | None]] = []
    for part in _pieces(len(positions), len(surfaces)):
        with np.errstate(all="ignore"):
            found = [
                shadow_rays(scene, light, floats(positions[part]), own[part]) for light in range(len(scene.lights))
            ]
            told = [(blocked, _lists(possible)) for blocked, possible in found]
        answer += [
            [None if blocked[row] else [surfaces[column] for column in lists[row]] for blocked, lists in told]
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
    # Backwards nothing counts, and sideways nothing is known; both are left to the balls.
    unknown = ~depth.above()
    low, high = near / depth, far / depth
    return Span(
        low=Margin(np.where(unknown, 0, low.middle), np.where(unknown, np.inf, low.radius)),
        high=Margin(np.where(unknown, 0, high.middle), np.where(unknown, np.inf, high.radius)),
    )


def _pieces(rays: int, faces: int) -> list[slice]:
    piece = max(1, CELLS // max(1, faces))
    return [slice(start, start + piece) for start in range(0, rays, piece)]
