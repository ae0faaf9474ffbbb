"""For every image point: the surfaces that may be hit first, and those that may block each light."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.reference.certified.camera_frame import View, view_of
from rayproof.reference.certified.fields import Balls, exact, precision
from rayproof.reference.certified.filters.margins import SAFE, UNIT, Margin, floats, of, products
from rayproof.reference.certified.filters.reach import Reach, Span, reach
from rayproof.reference.certified.light_paths import Suspects
from rayproof.reference.certified.placements import faces_of, rational
from rayproof.reference.certified.vectors import Rational
from rayproof.reference.certified.worlds import Surface

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
    scene: Scene, surfaces: tuple[Surface, ...], view: View, points: np.ndarray, *, lights: bool
) -> Iterator[Suspects]:
    directions = _directions(view, points)
    found = _all(scene, rational(scene.camera.eye), directions, _clip_span(scene, directions))
    nearest = found.high.min(axis=1, initial=np.inf)
    possible = ~(found.low > nearest[:, np.newaxis]) & (found.low != np.inf)
    if not lights or not scene.lights:
        yield from _told(surfaces, possible, [])
        return
    # Where one surface alone is left, and surely hit, the hit point is known well enough to filter the feelers.
    rows = np.flatnonzero((possible.sum(axis=1) == 1) & (nearest < np.inf))
    own = possible[rows].argmax(axis=1) if surfaces else np.zeros(0, dtype=int)
    low, high = found.low[rows, own], found.high[rows, own]
    radius = ((high - low) + np.abs(high) * UNIT) * SAFE
    t = Margin(low[:, np.newaxis], radius[:, np.newaxis])
    position = directions[rows] * t + of(rational(scene.camera.eye))
    blockers = []
    for light in range(len(scene.lights)):
        blocked, maybe = np.zeros(len(points), dtype=bool), np.ones_like(possible)
        blocked[rows], maybe[rows] = feelers(scene, light, position, own)
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


def feelers(scene: Scene, light: int, position: Margin, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which positions are surely blocked by another surface (N,), and which surfaces may block (N, surfaces)."""
    source = rational(scene.lights[light].position)
    ends = Span(low=floats(np.zeros((1, 1))), high=floats(np.ones((1, 1))))
    found = _all(scene, source, position - of(source), ends)
    possible, sure = found.low != np.inf, found.high < np.inf
    mine = (np.arange(len(own)), own)
    possible[mine] = sure[mine] = False
    return np.asarray(sure.any(axis=1)), possible


def _directions(view: View, points: np.ndarray) -> Margin:
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
            found = [feelers(scene, light, floats(positions[part]), own[part]) for light in range(len(scene.lights))]
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
