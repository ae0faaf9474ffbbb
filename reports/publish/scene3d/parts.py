"""The parts of a 3-D view as arrays: shapes, frustum, lights, rays, in layers around the scene's middle.

Browsers draw in float32, so coordinates are made relative to the scene's middle before they are rounded. The report's
page computes the same parts from the same data when a view is opened (page/html/scene.js); both read look.json for the
numbers of elements and for the colours.
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

# Four corners per side, counter-clockwise seen from outside; bit i of a corner's number is its coordinate on axis i.
CUBE_SIDES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))


@dataclass(frozen=True, kw_only=True)
class PolygonSurface:
    """Polygons with the same number of corners; they are shaded flat without `normals`."""

    points: np.ndarray  # (n, 3) m
    cells: np.ndarray  # (m, corners) indices of points
    normals: np.ndarray | None = None  # (n, 3) unit


def surface(
    shape: Shape, *, around: int, most: int, patch: np.ndarray | None = None, margin: float = 0.0
) -> PolygonSurface:
    """Return `shape` as polygons in world space.

    `around` is the number of corners of a sphere's equator. A mesh of more than `most` triangles is thinned. A plane is
    cut to the part around the world points `patch`, extended by `margin` [m] on each side.
    """
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    linear, offset = matrix[:3, :3], matrix[:3, 3]
    if isinstance(shape, Triangle | Mesh):
        triangles = (
            thinned(shape.vertices[shape.faces], most) if isinstance(shape, Mesh) else np.asarray(shape.vertices)
        )
        corners = triangles.reshape(-1, 3).astype(np.float64)
        return PolygonSurface(points=corners @ linear.T + offset, cells=np.arange(len(corners)).reshape(-1, 3))
    if isinstance(shape, Sphere):
        unit = ball(around)
        points = (np.asarray(shape.center) + shape.radius * unit.points) @ linear.T + offset
        normals = unit.points @ np.linalg.inv(linear)  # transformed with the inverse transpose
        # A reflection reverses the orientation of polygons, so that a ball would show its unlit inner side.
        cells = unit.cells if np.linalg.det(linear) > 0 else unit.cells[:, ::-1]
        return PolygonSurface(
            points=points, cells=cells, normals=normals / np.linalg.norm(normals, axis=-1, keepdims=True)
        )
    if isinstance(shape, Cube):
        corners = np.asarray([[(number >> axis & 1) - 0.5 for axis in range(3)] for number in range(8)])
        return PolygonSurface(points=corners @ linear.T + offset, cells=np.asarray(CUBE_SIDES))
    low, high = np.full(2, -0.5), np.full(2, 0.5)
    if isinstance(shape, Plane):
        assert patch is not None, "an infinite plane needs points to be drawn around"
        low, high = _patch(matrix, patch, margin)
    elif not isinstance(shape, Square):
        raise TypeError(f"there is no surface of {type(shape).__name__}")
    corners = np.asarray([(low[0], low[1], 0), (high[0], low[1], 0), (high[0], high[1], 0), (low[0], high[1], 0)])
    return PolygonSurface(points=corners @ linear.T + offset, cells=np.asarray([[0, 1, 2, 3]]))


def ball(around: int) -> PolygonSurface:
    """Return the unit sphere of `around` meridians and half as many circles of latitude; its points are its normals."""
    rings = around // 2
    theta = (np.pi * np.arange(rings + 1) / rings)[:, None]
    phi = 2 * np.pi * np.arange(around) / around
    points = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1
    ).reshape(-1, 3)
    ring, place = np.divmod(np.arange(rings * around), around)
    corner, neighbour = ring * around + place, ring * around + (place + 1) % around
    cells = np.stack([corner, corner + around, neighbour + around, neighbour], axis=-1)
    return PolygonSurface(points=points, cells=cells, normals=points)


def _patch(matrix: np.ndarray, patch: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of a plane's visible part, in object space: around the points on it, or else around all."""
    inverse = np.linalg.inv(matrix)
    local = np.asarray(patch, dtype=np.float64) @ inverse[:3, :3].T + inverse[:3, 3]
    on = local[np.abs(local[:, 2]) < 1e-3 * max(1.0, float(np.abs(local).max()))]
    # A grazing view has hits out to the horizon, so only the middle nine tenths of the points are used.
    low, high = np.quantile((on if len(on) else local)[:, :2], (0.05, 0.95), axis=0)
    # The margin is a length in world space; the axes of the plane's object space may be scaled.
    scale = np.linalg.norm(matrix[:3, :2], axis=0)
    return low - margin / scale, high + margin / scale


def thinned(corners: np.ndarray, most: int) -> np.ndarray:
    """Reduce triangles (faces, 3, 3) to about `most` that look like them; fewer are returned unchanged.

    All corners in a cell of a grid are replaced by the first, and triangles with two corners in a cell are dropped. If
    almost none is left, because all triangles are small and separate, a regular subset is returned instead.
    """
    if len(corners) <= most:
        return corners
    points = corners.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    cells = max(2, int((most / 6) ** 0.5))  # along the longest side; a surface crosses about 3 cells^2 grid cells
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


# The stage for the colours of hit points, in this order, if the case has no blamed stage.
COLORED = (Stage.DISTANCE, Stage.POSITION, Stage.RADIANCE)
Answers = Mapping[Stage, np.ndarray]


class Layer(msgspec.Struct, forbid_unknown_fields=True):
    """The appearance of a layer's parts; `length` is in sizes of the scene, and the maximum for (shadow) rays."""

    color: tuple[str, str]  # on a light and on a dark page
    width: float = 1.0  # px, of lines and points
    length: float = 0.0


class Aim(msgspec.Struct, forbid_unknown_fields=True, rename={"direction": "from"}):
    """The viewpoint: `direction` is relative to the scene's camera, along forward, right and up."""

    direction: tuple[float, float, float]
    distance: float  # sizes of the scene
    angle: float  # degrees, vertical


class ShapeLook(msgspec.Struct, forbid_unknown_fields=True):
    """The appearance of shapes: the colour is albedo x `albedo` + `white`; below `few` polygons edges are drawn."""

    albedo: float
    white: float
    ambient: float
    diffuse: float
    surrounding: float  # opacity of a shape around the camera, which would hide the other shapes
    edges: str
    few: int


class Look(msgspec.Struct, forbid_unknown_fields=True):
    """The appearance of a scene: look.json."""

    still: tuple[int, int]  # px
    background: tuple[str, str]
    camera: Aim
    frustum: float  # depth, sizes of the scene
    far: float  # sizes of the scene; eye and lights beyond are omitted, because the depth buffer has 24 bits
    margin: float  # width of the border around a plane's hits, in sizes of the scene
    around: tuple[int, int]  # corners of a ball's equator, minimum and maximum
    quads: int  # of all spheres together
    triangles: int  # of a mesh, at most; hardly more than the pixels of a picture
    shape: ShapeLook
    points: int  # number of hits that are drawn
    worst: int  # number of the worst hits among them
    rays: int
    shadow_rays: int
    normals: int
    lights: int  # at most, because a thousand balls would hide the lit surfaces
    colors: str  # colour map of the points, from good to bad
    layers: dict[str, Layer]
    pixel: dict[str, Layer]  # the appearance of the selected pixel's parts in the page


@lru_cache(maxsize=1)
def look() -> Look:
    """Return the content of look.json."""
    text = files("rayproof.reports.publish.scene3d").joinpath("look.json").read_bytes()
    return msgspec.json.decode(text, type=Look)


@dataclass(frozen=True, kw_only=True)
class Part:
    """Points, lines or polygons: cells of one, two or more corners."""

    name: str
    layer: str
    points: np.ndarray  # (n, 3)
    cells: np.ndarray  # (m, corners) indices of points
    normals: np.ndarray | None = None  # (n, 3) unit
    shares: np.ndarray | None = None  # (n,) position of each point on the colour map: 0 is the best, 1 the worst
    color: str | None = None  # instead of the layer's colour
    opacity: float = 1.0
    edges: bool = False


@dataclass(frozen=True, kw_only=True)
class SceneView:
    """A scene's parts; x = (x_world - middle) / size."""

    parts: tuple[Part, ...]
    middle: np.ndarray  # m
    size: float  # m
    colored: Stage | None  # the stage whose errors are the colours of the points
    range: tuple[float, float] | None  # log10 of the smallest positive and of the largest finite error, if any


@dataclass(frozen=True, kw_only=True)
class HitPoints:
    """Hit points and their pixels."""

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
        """Return a mask of the world points (n, 3) that are near enough to be drawn."""
        return np.linalg.norm(self.inside(points), axis=-1) < look().far


def view_of(scene: Scene, subject: Answers | None, reference: Answers | None, blamed: str | None) -> SceneView:
    """Return the view of a scene and the images of two renderers, coloured by the errors of the blamed stage."""
    colored = colored_stage(subject, reference, blamed)
    error = None if colored is None else absolute_error(subject or {}, reference or {}, colored)
    answers = subject or reference or {}
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
    if len(near := (shown_lights := few(lights, look().lights))[frame.near(shown_lights)]):
        parts.append(_bulbs(frame.inside(near)))
    limits = None
    if hits is not None:
        shares = None
        if error is not None:
            with np.errstate(divide="ignore"):
                shares, limits = shares_of(np.log10(hits.of(error)))
        parts += _measured(hits, shares, answers, reference if subject else None, eye, lights, frame)
    return SceneView(parts=tuple(parts), middle=frame.middle, size=frame.size, colored=colored, range=limits)


def chosen_hits(answers: Answers, error: np.ndarray | None) -> HitPoints | None:
    """Return a selection of hits, evenly spaced, and those with the largest `error`; None if there are no hits."""
    if Stage.POSITION not in answers or Stage.OBJECT not in answers:
        return None
    positions = answers[Stage.POSITION]
    hit = (answers[Stage.OBJECT][..., 0] >= 0) & np.isfinite(positions).all(axis=-1)
    rows, columns = np.nonzero(hit)
    if not len(rows):
        return None
    chosen = few(np.arange(len(rows)), look().points)
    if error is not None:
        # The worst pixels are the most important ones, so they are never omitted.
        bad = error[rows, columns]
        worst = np.argsort(np.where(np.isfinite(bad), bad, np.inf), kind="stable")[-look().worst :]
        chosen = np.unique(np.concatenate([chosen, worst]))
    rows, columns = rows[chosen], columns[chosen]
    normals = answers.get(Stage.NORMAL, np.zeros_like(positions))[rows, columns]
    return HitPoints(
        rows=rows, columns=columns, points=positions[rows, columns].astype(np.float64), normals=normals.astype(float)
    )


def colored_stage(subject: Answers | None, reference: Answers | None, blamed: str | None) -> Stage | None:
    """Return the stage whose errors are drawn: the blamed stage, or else the first of `COLORED` with two images."""
    wanted = [Stage(blamed)] if blamed in set(Stage) else []
    return next((stage for stage in (*wanted, *COLORED) if _comparable(subject, reference, stage)), None)


def _comparable(subject: Answers | None, reference: Answers | None, stage: Stage) -> bool:
    return bool(
        subject
        and reference
        and stage in subject
        and stage in reference
        and subject[stage].shape == reference[stage].shape
    )


def absolute_error(subject: Answers, reference: Answers, stage: Stage) -> np.ndarray:
    """Return the largest absolute difference over channels (height, width); it may be NaN or infinite."""
    a, b = subject[stage].astype(np.float64), reference[stage].astype(np.float64)
    with np.errstate(invalid="ignore"):
        return np.where(a == b, 0.0, np.abs(a - b)).max(axis=-1)


def shares_of(errors: np.ndarray) -> tuple[np.ndarray, tuple[float, float] | None]:
    """Scale log10 of errors to 0 (best) to 1 (worst); also return the smallest and the largest finite value."""
    numbers = errors[np.isfinite(errors)]
    if not len(numbers):
        return np.where(np.isneginf(errors), 0.0, 1.0), None
    low, high = float(numbers.min()), float(numbers.max())
    # An exact value is ranked with the best error, NaN and infinity with the worst.
    finite = np.where(np.isfinite(errors), errors, np.where(np.isneginf(errors), low, high))
    shares = (finite - low) / ((high - low) or 1.0)
    return np.where(np.isfinite(errors) | np.isneginf(errors), shares, 1.0), (low, high)


def few(rows: np.ndarray, most: int) -> np.ndarray:
    """Return at most `most` rows, evenly spaced."""
    return rows[np.linspace(0, len(rows) - 1, min(len(rows), most)).astype(int)] if len(rows) else rows


def _around(balls: int) -> int:
    least, most = look().around
    return int(np.clip(np.sqrt(2 * look().quads / max(1, balls)), least, most)) // 2 * 2


def _framing(scene: Scene, points: np.ndarray, bounded: list[PolygonSurface], eye_and_lights: np.ndarray) -> _Frame:
    """Return the units of a view that contains the hits, the bounded shapes and, if they are near, eye and lights."""
    # Hits out to the horizon would make everything else tiny, so only the middle nine tenths are used.
    corners = [np.quantile(points, (0.05, 0.95), axis=0)] if len(points) else []
    corners += [np.stack([polygons.points.min(axis=0), polygons.points.max(axis=0)]) for polygons in bounded]
    inside = np.concatenate(corners) if corners else np.asarray([scene.camera.target], dtype=np.float64)
    low, high = inside.min(axis=0), inside.max(axis=0)
    size = float(np.linalg.norm(high - low)) or float(np.linalg.norm(eye_and_lights[0] - inside[0])) or 1.0
    near = eye_and_lights[np.linalg.norm(eye_and_lights - (low + high) / 2, axis=-1) < 2.5 * size]
    everything = np.concatenate([inside, near])
    low, high = everything.min(axis=0), everything.max(axis=0)
    return _Frame(middle=(low + high) / 2, size=float(np.linalg.norm(high - low)) or 1.0)


def _shapes(scene: Scene, points: np.ndarray, bounded: Mapping[int, PolygonSurface], frame: _Frame) -> Iterator[Part]:
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
    """Return the end points [m] (edges, 2, 3) of the frustum's edges, and of a tick that marks the upper edge."""
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
    hits: HitPoints,
    shares: np.ndarray | None,
    answers: Answers,
    reference: Answers | None,
    eye: np.ndarray,
    lights: np.ndarray,
    frame: _Frame,
) -> Iterator[Part]:
    """Yield the parts at hit points: rays, shadow rays, the points and normals."""
    layers, size = look().layers, frame.size
    ray_ends = few(hits.points, look().rays)
    # Only the last section of a long ray is drawn, because the depth buffer is too coarse for lines of a kilometre.
    yield _lines("rays", np.stack([_towards(ray_ends, eye, layers["rays"].length * size), ray_ends], axis=1), frame)
    if Stage.VISIBILITY in answers and len(lights) and answers[Stage.VISIBILITY].shape[-1] >= len(lights):
        sample = few(np.arange(len(hits.points)), look().shadow_rays)
        shown = few(np.arange(len(lights)), look().lights)
        arrives = hits.of(answers[Stage.VISIBILITY])[sample][:, shown] > 0
        starts = np.broadcast_to(hits.points[sample][:, None], (len(sample), len(shown), 3))
        for layer, chosen in (("shadow_rays, lit", arrives), ("shadow_rays, blocked", ~arrives)):
            ends = _towards(starts, lights[shown], layers[layer].length * size)
            if chosen.any():
                yield _lines(layer, np.stack([starts, ends], axis=2)[chosen], frame)
    cells = np.arange(len(hits.points)).reshape(-1, 1)
    yield Part(name="points", layer="points", points=frame.inside(hits.points), cells=cells, shares=shares)
    sample = few(np.arange(len(hits.points)), look().normals)
    normals_by_layer = [("normals, ours", hits.normals)]
    if reference and Stage.NORMAL in reference:
        normals_by_layer.append(("normals, reference", hits.of(reference[Stage.NORMAL])))
    for layer, normals in normals_by_layer:
        unit = sample[np.isfinite(normals[sample]).all(axis=-1) & (np.linalg.norm(normals[sample], axis=-1) > 0.5)]
        if len(unit):
            ends = hits.points[unit] + layers[layer].length * size * normals[unit]
            yield _lines(layer, np.stack([hits.points[unit], ends], axis=1), frame)


def _towards(starts: np.ndarray, ends: np.ndarray, most: float) -> np.ndarray:
    """Move points from `starts` to `ends`, but by at most `most` [m]."""
    offset = ends - starts
    length = np.linalg.norm(offset, axis=-1, keepdims=True)
    return starts + offset * np.minimum(1, most / np.maximum(length, 1e-300))


def _lines(layer: str, ends: np.ndarray, frame: _Frame) -> Part:
    points = frame.inside(ends)
    return Part(name=layer, layer=layer, points=points, cells=np.arange(len(points)).reshape(-1, 2))
