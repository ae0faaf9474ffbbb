"""The parts of a 3-D view as arrays: shapes, frustum, lights, rays, in layers around the scene's middle.

Browsers draw in float32, so coordinates are taken relative to what is looked at before they are rounded. The report's
page makes the same parts of the same numbers when a view is opened (page/html/scene.js); look.json says for both how
many of everything are drawn and in which colours.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

import msgspec
import numpy as np

from rayproof.cases.placement import frame
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage

# Four corners of each side, counter-clockwise seen from outside; bit i of a corner's number is its place on axis i.
CUBE_SIDES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Polygons of equally many corners; without `normals` each is flat."""

    points: np.ndarray  # (n, 3) m
    cells: np.ndarray  # (m, corners) numbers of points
    normals: np.ndarray | None = None  # (n, 3) unit


def surface(shape: Shape, *, around: int, most: int, patch: np.ndarray | None = None, margin: float = 0.0) -> Surface:
    """Return `shape` in world space; of a plane the part around the world points `patch`, `margin` [m] wider.

    `around` is the number of corners of a sphere's equator. A mesh of more than `most` triangles is thinned.
    """
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    linear, offset = matrix[:3, :3], matrix[:3, 3]
    if isinstance(shape, Triangle | Mesh):
        own = thinned(shape.vertices[shape.faces], most) if isinstance(shape, Mesh) else np.asarray(shape.vertices)
        corners = own.reshape(-1, 3).astype(np.float64)
        return Surface(points=corners @ linear.T + offset, cells=np.arange(len(corners)).reshape(-1, 3))
    if isinstance(shape, Sphere):
        unit = ball(around)
        points = (np.asarray(shape.center) + shape.radius * unit.points) @ linear.T + offset
        normals = unit.points @ np.linalg.inv(linear)  # by the inverse transpose
        # A mirrored ball would turn its dark side to whoever looks.
        cells = unit.cells if np.linalg.det(linear) > 0 else unit.cells[:, ::-1]
        return Surface(points=points, cells=cells, normals=normals / np.linalg.norm(normals, axis=-1, keepdims=True))
    if isinstance(shape, Cube):
        corners = np.asarray([[(number >> axis & 1) - 0.5 for axis in range(3)] for number in range(8)])
        return Surface(points=corners @ linear.T + offset, cells=np.asarray(CUBE_SIDES))
    low, high = np.full(2, -0.5), np.full(2, 0.5)
    if isinstance(shape, Plane):
        assert patch is not None, "an infinite plane needs points to be drawn around"
        low, high = _patch(matrix, patch, margin)
    elif not isinstance(shape, Square):
        raise TypeError(f"there is no surface of {type(shape).__name__}")
    corners = np.asarray([(low[0], low[1], 0), (high[0], low[1], 0), (high[0], high[1], 0), (low[0], high[1], 0)])
    return Surface(points=corners @ linear.T + offset, cells=np.asarray([[0, 1, 2, 3]]))


def ball(around: int) -> Surface:
    """Return the unit sphere by `around` meridians and half as many circles of latitude; its points are its normals."""
    rings = around // 2
    theta = (np.pi * np.arange(rings + 1) / rings)[:, None]
    phi = 2 * np.pi * np.arange(around) / around
    points = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1
    ).reshape(-1, 3)
    ring, place = np.divmod(np.arange(rings * around), around)
    here, beside = ring * around + place, ring * around + (place + 1) % around
    cells = np.stack([here, here + around, beside + around, beside], axis=-1)
    return Surface(points=points, cells=cells, normals=points)


def _patch(matrix: np.ndarray, patch: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners, in the plane's own space, of the part below those points that lie on it, else below all."""
    inverse = np.linalg.inv(matrix)
    local = np.asarray(patch, dtype=np.float64) @ inverse[:3, :3].T + inverse[:3, 3]
    on = local[np.abs(local[:, 2]) < 1e-3 * max(1.0, float(np.abs(local).max()))]
    # A grazing view has hits out to the horizon: the middle nine tenths are what is worth seeing.
    low, high = np.quantile((on if len(on) else local)[:, :2], (0.05, 0.95), axis=0)
    # The margin is a world length; the plane's own axes may be scaled.
    scale = np.linalg.norm(matrix[:3, :2], axis=0)
    return low - margin / scale, high + margin / scale


def thinned(corners: np.ndarray, most: int) -> np.ndarray:
    """Return triangles (faces, 3, 3) that look like the given ones, where these are more than about `most`.

    Corners in one cell of a grid become the first of them, and triangles of which two corners do so are left out. Where
    hardly any is left, for all are smaller than a cell and lie apart, some of them stand for all.
    """
    if len(corners) <= most:
        return corners
    points = corners.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    cells = max(2, int((most / 6) ** 0.5))  # along the longest side: a surface meets about three times its square
    scale = cells / (float((high - low).max()) or 1.0)
    places = np.zeros(len(points), dtype=np.int64)
    for axis in range(3):
        places = places * (cells + 1) + ((points[:, axis] - low[axis]) * scale).astype(np.int64)
    _, first, number = np.unique(places, return_index=True, return_inverse=True)
    faces = number.reshape(-1, 3)
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    if len(faces) < most // 100:
        return corners[:: -(-len(corners) // most)]
    ordered = np.sort(faces, axis=1)
    once = np.unique((ordered[:, 0] * len(first) + ordered[:, 1]) * len(first) + ordered[:, 2], return_index=True)[1]
    return points[first[faces[np.sort(once)]]]


# What is coloured unless the case blames a stage of its own.
COLORED = (Stage.DISTANCE, Stage.POSITION, Stage.RADIANCE)
Answers = Mapping[Stage, np.ndarray]


class Layer(msgspec.Struct, forbid_unknown_fields=True):
    """How the parts of a layer look; `length` is in sizes of the scene, of rays and shadow rays the longest."""

    color: tuple[str, str]  # on a light and on a dark page
    width: float = 1.0  # px, of lines and points
    length: float = 0.0


class Aim(msgspec.Struct, forbid_unknown_fields=True, rename={"direction": "from"}):
    """Where one looks from: `direction` is of the scene's own camera, along forward, right and up."""

    direction: tuple[float, float, float]
    distance: float  # sizes of the scene
    angle: float  # degrees, vertical


class ShapeLook(msgspec.Struct, forbid_unknown_fields=True):
    """How shapes look: of the colour albedo x `albedo` + `white`, those of `few` polygons with their edges."""

    albedo: float
    white: float
    ambient: float
    diffuse: float
    surrounding: float  # opacity of one that the camera is inside of, which would hide everything
    edges: str
    few: int


class Look(msgspec.Struct, forbid_unknown_fields=True):
    """How a scene looks: look.json."""

    still: tuple[int, int]  # px
    background: tuple[str, str]
    camera: Aim
    frustum: float  # depth, sizes of the scene
    far: float  # sizes of the scene, beyond which eye and lights are left out: the depth buffer has 24 bits
    margin: float  # sizes of the scene, of a plane around its hits
    around: tuple[int, int]  # corners of a ball's equator, at least and at most
    quads: int  # of all spheres together
    triangles: int  # of a mesh: hardly more than a picture has pixels
    shape: ShapeLook
    points: int  # hits that are shown
    worst: int  # of which so many are the worst
    rays: int
    shadow_rays: int
    normals: int
    lights: int  # a thousand balls hide what they light
    colors: str  # of the points, from good to bad
    layers: dict[str, Layer]
    pixel: dict[str, Layer]  # what shows the pixel that is pointed at, in the page


@lru_cache(maxsize=1)
def look() -> Look:
    """Return what look.json says."""
    text = files("rayproof.reports.publish.scene3d").joinpath("look.json").read_bytes()
    return msgspec.json.decode(text, type=Look)


@dataclass(frozen=True, kw_only=True)
class Part:
    """Points, lines or polygons: one, two or more corners a cell."""

    name: str
    layer: str
    points: np.ndarray  # (n, 3)
    cells: np.ndarray  # (m, corners) numbers of points
    normals: np.ndarray | None = None  # (n, 3) unit
    shares: np.ndarray | None = None  # (n,) how bad the points are, from 0 to 1
    color: str | None = None  # instead of the layer's
    opacity: float = 1.0
    edges: bool = False


@dataclass(frozen=True, kw_only=True)
class View:
    """A scene's parts; x = (x_world - middle) / size."""

    parts: tuple[Part, ...]
    middle: np.ndarray  # m
    size: float  # m
    colored: Stage | None  # the stage whose errors the points show
    range: tuple[float, float] | None  # log10 of the smallest and of the largest error; None where all are exact


@dataclass(frozen=True, kw_only=True)
class Hits:
    """Hit points and the pixels that they belong to."""

    rows: np.ndarray  # (n,)
    columns: np.ndarray  # (n,)
    points: np.ndarray  # (n, 3) m
    normals: np.ndarray  # (n, 3)

    def of(self, image: np.ndarray) -> np.ndarray:
        """Return the values of an image (height, width, ...) at these pixels, in float64."""
        return image[self.rows, self.columns].astype(np.float64)


@dataclass(frozen=True, kw_only=True)
class _Frame:
    """The view's units."""

    middle: np.ndarray  # m
    size: float  # m

    def inside(self, points: Any) -> np.ndarray:
        """Return world points [m] in view units (n, 3)."""
        return (np.asarray(points, dtype=np.float64).reshape(-1, 3) - self.middle) / self.size

    def near(self, points: np.ndarray) -> np.ndarray:
        """Return whether each world point (n, 3) is near enough to be drawn."""
        return np.linalg.norm(self.inside(points), axis=-1) < look().far


def view_of(scene: Scene, ours: Answers | None, theirs: Answers | None, blamed: str | None) -> View:
    """Return what is shown of a scene and the answers of two renderers, coloured by the errors of the blamed stage."""
    colored = colored_stage(ours, theirs, blamed)
    error = None if colored is None else absolute_error(ours or {}, theirs or {}, colored)
    answers = ours or theirs or {}
    hits = chosen_hits(answers, error)
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    lights = np.asarray([light.position for light in scene.lights], dtype=np.float64).reshape(-1, 3)
    around = _around(sum(isinstance(shape, Sphere) for shape in scene.shapes))
    bounded = {
        index: surface(shape, around=around, most=look().triangles)
        for index, shape in enumerate(scene.shapes)
        if not isinstance(shape, Plane)
    }
    points = np.empty((0, 3)) if hits is None else hits.points
    frame = _framing(scene, points, list(bounded.values()), np.concatenate([eye[None], lights]))
    parts = [*_shapes(scene, points, bounded, frame)]
    if frame.near(eye[None])[0]:
        parts.append(_lines("camera", _frustum(scene.camera, frame.size), frame))
    if len(near := (shown := few(lights, look().lights))[frame.near(shown)]):
        parts.append(_bulbs(frame.inside(near)))
    limits = None
    if hits is not None:
        shares = None
        if error is not None:
            with np.errstate(divide="ignore"):
                shares, limits = shares_of(np.log10(hits.of(error)))
        parts += _measured(hits, shares, answers, theirs if ours else None, eye, lights, frame)
    return View(parts=tuple(parts), middle=frame.middle, size=frame.size, colored=colored, range=limits)


def chosen_hits(answers: Answers, error: np.ndarray | None) -> Hits | None:
    """Return some hits, evenly spaced and the worst by `error` among them; None without any."""
    if Stage.POSITION not in answers or Stage.OBJECT not in answers:
        return None
    positions = answers[Stage.POSITION]
    hit = (answers[Stage.OBJECT][..., 0] >= 0) & np.isfinite(positions).all(axis=-1)
    rows, columns = np.nonzero(hit)
    if not len(rows):
        return None
    chosen = few(np.arange(len(rows)), look().points)
    if error is not None:
        # The worst pixels are what one looks for; thinning must not lose them.
        bad = error[rows, columns]
        worst = np.argsort(np.where(np.isfinite(bad), bad, np.inf), kind="stable")[-look().worst :]
        chosen = np.unique(np.concatenate([chosen, worst]))
    rows, columns = rows[chosen], columns[chosen]
    normals = answers.get(Stage.NORMAL, np.zeros_like(positions))[rows, columns]
    return Hits(
        rows=rows, columns=columns, points=positions[rows, columns].astype(np.float64), normals=normals.astype(float)
    )


def colored_stage(ours: Answers | None, theirs: Answers | None, blamed: str | None) -> Stage | None:
    """Return the stage whose errors are drawn: the blamed one, else the first that both answered; None without."""
    wanted = [Stage(blamed)] if blamed in set(Stage) else []
    return next((stage for stage in (*wanted, *COLORED) if _comparable(ours, theirs, stage)), None)


def _comparable(ours: Answers | None, theirs: Answers | None, stage: Stage) -> bool:
    return bool(ours and theirs and stage in ours and stage in theirs and ours[stage].shape == theirs[stage].shape)


def absolute_error(ours: Answers, theirs: Answers, stage: Stage) -> np.ndarray:
    """Return the largest absolute difference over channels (height, width); NaN and infinities stay what they are."""
    a, b = ours[stage].astype(np.float64), theirs[stage].astype(np.float64)
    with np.errstate(invalid="ignore"):
        return np.where(a == b, 0.0, np.abs(a - b)).max(axis=-1)


def shares_of(errors: np.ndarray) -> tuple[np.ndarray, tuple[float, float] | None]:
    """Return how bad log10 of errors are, from 0 to 1, and the smallest and the largest that is a number."""
    known = errors[np.isfinite(errors)]
    if not len(known):
        return np.where(np.isneginf(errors), 0.0, 1.0), None
    low, high = float(known.min()), float(known.max())
    # Exact is as good as the best there is, no number as bad as the worst.
    finite = np.where(np.isfinite(errors), errors, np.where(np.isneginf(errors), low, high))
    shares = (finite - low) / ((high - low) or 1.0)
    return np.where(np.isfinite(errors) | np.isneginf(errors), shares, 1.0), (low, high)


def few(rows: np.ndarray, most: int) -> np.ndarray:
    """Return at most `most` rows, evenly spaced."""
    return rows[np.linspace(0, len(rows) - 1, min(len(rows), most)).astype(int)] if len(rows) else rows


def _around(balls: int) -> int:
    least, most = look().around
    return int(np.clip(np.sqrt(2 * look().quads / max(1, balls)), least, most)) // 2 * 2


def _framing(scene: Scene, points: np.ndarray, bounded: list[Surface], others: np.ndarray) -> _Frame:
    """Frame the hits, the bounded shapes and, unless they are far, eye and lights."""
    # Hits out to the horizon would shrink everything else to nothing: the middle nine tenths decide.
    corners = [np.quantile(points, (0.05, 0.95), axis=0)] if len(points) else []
    corners += [np.stack([one.points.min(axis=0), one.points.max(axis=0)]) for one in bounded]
    inside = np.concatenate(corners) if corners else np.asarray([scene.camera.target], dtype=np.float64)
    low, high = inside.min(axis=0), inside.max(axis=0)
    size = float(np.linalg.norm(high - low)) or float(np.linalg.norm(others[0] - inside[0])) or 1.0
    near = others[np.linalg.norm(others - (low + high) / 2, axis=-1) < 2.5 * size]
    everything = np.concatenate([inside, near])
    low, high = everything.min(axis=0), everything.max(axis=0)
    return _Frame(middle=(low + high) / 2, size=float(np.linalg.norm(high - low)) or 1.0)


def _shapes(scene: Scene, points: np.ndarray, bounded: Mapping[int, Surface], frame: _Frame) -> Iterator[Part]:
    eye = frame.inside(scene.camera.eye)[0]
    patch = points if len(points) else np.asarray([scene.camera.target])
    for index, shape in enumerate(scene.shapes):
        drawn = bounded.get(index)
        if drawn is None:
            drawn = surface(shape, around=0, most=0, patch=patch, margin=look().margin * frame.size)
        corners = frame.inside(drawn.points)
        surrounds = bool(((corners.min(axis=0) < eye) & (eye < corners.max(axis=0))).all())
        yield Part(
            name=f"shape {index}",
            layer="geometry",
            points=corners,
            cells=drawn.cells,
            normals=drawn.normals,
            color=_color(shape),
            opacity=look().shape.surrounding if surrounds else 1.0,
            edges=len(drawn.cells) < look().shape.few,
        )


def _color(shape: Shape) -> str:
    lightened = np.clip(np.asarray(shape.albedo) * look().shape.albedo + look().shape.white, 0, 1)
    return "#" + "".join(f"{int(255 * value + 0.5):02x}" for value in lightened)


def _frustum(camera: Camera, size: float) -> np.ndarray:
    """Return the ends [m] of the frustum's edges, two rows each, and of a tick above its upper edge, which is up."""
    eye, (right, up, forward) = np.asarray(camera.eye, dtype=np.float64), frame(camera.eye, camera.target, camera.up)
    depth = look().frustum * size
    half = depth * np.tan(camera.alpha)
    ends = [
        eye + depth * forward + x * half * camera.aspect * right + y * half * up
        for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    tick = (ends[2] + ends[3]) / 2
    lines = [*((eye, end) for end in ends), *((ends[i], ends[(i + 1) % 4]) for i in range(4))]
    return np.asarray([*lines, (tick, tick + 0.25 * half * up)])


def _bulbs(places: np.ndarray) -> Part:
    small = ball(12)
    points = places[:, None] + look().layers["lights"].length * small.points
    cells = len(small.points) * np.arange(len(places))[:, None, None] + small.cells
    return Part(name="lights", layer="lights", points=points.reshape(-1, 3), cells=cells.reshape(-1, 4))


def _measured(
    hits: Hits,
    shares: np.ndarray | None,
    answers: Answers,
    theirs: Answers | None,
    eye: np.ndarray,
    lights: np.ndarray,
    frame: _Frame,
) -> Iterator[Part]:
    """Yield what hangs on hit points: the points, rays, shadow rays and normals."""
    layers, size = look().layers, frame.size
    seen = few(hits.points, look().rays)
    # From afar only the last stretch: lines a kilometre long lose their digits in the depth buffer.
    yield _lines("rays", np.stack([_towards(seen, eye, layers["rays"].length * size), seen], axis=1), frame)
    if Stage.VISIBILITY in answers and len(lights) and answers[Stage.VISIBILITY].shape[-1] >= len(lights):
        some = few(np.arange(len(hits.points)), look().shadow_rays)
        shown = few(np.arange(len(lights)), look().lights)
        arrives = hits.of(answers[Stage.VISIBILITY])[some][:, shown] > 0
        starts = np.broadcast_to(hits.points[some][:, None], (len(some), len(shown), 3))
        for layer, chosen in (("shadow_rays, lit", arrives), ("shadow_rays, blocked", ~arrives)):
            ends = _towards(starts, lights[shown], layers[layer].length * size)
            if chosen.any():
                yield _lines(layer, np.stack([starts, ends], axis=2)[chosen], frame)
    cells = np.arange(len(hits.points)).reshape(-1, 1)
    yield Part(name="points", layer="points", points=frame.inside(hits.points), cells=cells, shares=shares)
    some = few(np.arange(len(hits.points)), look().normals)
    both = [("normals, ours", hits.normals)]
    if theirs and Stage.NORMAL in theirs:
        both.append(("normals, reference", hits.of(theirs[Stage.NORMAL])))
    for layer, normals in both:
        unit = some[np.isfinite(normals[some]).all(axis=-1) & (np.linalg.norm(normals[some], axis=-1) > 0.5)]
        if len(unit):
            ends = hits.points[unit] + layers[layer].length * size * normals[unit]
            yield _lines(layer, np.stack([hits.points[unit], ends], axis=1), frame)


def _towards(starts: np.ndarray, ends: np.ndarray, most: float) -> np.ndarray:
    """Return the points from `starts` towards `ends`, at most so far [m]."""
    way = ends - starts
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    return starts + way * np.minimum(1, most / np.maximum(length, 1e-300))


def _lines(layer: str, ends: np.ndarray, frame: _Frame) -> Part:
    points = frame.inside(ends)
    return Part(name=layer, layer=layer, points=points, cells=np.arange(len(points)).reshape(-1, 2))
