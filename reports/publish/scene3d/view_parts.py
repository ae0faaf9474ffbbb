"""What the 3-D view of a case consists of: named parts in layers, in units of the scene's size around its middle.

The browser draws in float32, so coordinates are taken relative to what is looked at before they are rounded. The parts
of the layer "pixel" are empty hands: the page moves their ends to the pixel that the reader points at.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, TypedDict, Unpack

import numpy as np

from rayproof.cases.scene import Scene, Sphere
from rayproof.cases.stages import Stage
from rayproof.reports.publish.scene3d.picture_hits import Hits
from rayproof.reports.publish.scene3d.picture_lines import LineStyle
from rayproof.reports.publish.scene3d.picture_places import few, frustum, ray_ends
from rayproof.reports.publish.scene3d.picture_scene import MOST_LIGHTS, MOST_NORMALS, bulbs, light_places
from rayproof.reports.publish.scene3d.picture_shapes import surface

MOST_TRIANGLES = 3600  # of all shapes of a view
ROUNDEST, LEAST_ROUND = 40, 10  # corners of a sphere's equator
# Scene sizes beyond which eye and lights are left out: they would squeeze the rest into the depth's last bits.
FAR = 20.0
RAYS = 16


class MeshStyle(TypedDict, total=False):
    """How a mesh looks, as `Plotter.add_mesh` has it."""

    color: str | np.ndarray
    opacity: float
    smooth_shading: bool
    show_edges: bool
    edge_color: str
    lighting: bool
    point_size: float
    scalars: str
    cmap: str
    clim: tuple[float, float]
    show_scalar_bar: bool


@dataclass(frozen=True, kw_only=True)
class Part:
    """One mesh in view units, in a layer that the reader can switch."""

    name: str
    layer: str
    mesh: Any  # pyvista.PolyData
    style: MeshStyle = field(default_factory=MeshStyle)
    plain: LineStyle | None = None  # instead, of lines or points of one colour


@dataclass(frozen=True, kw_only=True)
class Frame:
    """View units: x_view = (x - middle) / size."""

    middle: np.ndarray  # m
    size: float  # m

    def inside(self, points: Any) -> np.ndarray:
        """Return world points [m] in view units (n, 3)."""
        return (np.asarray(points, dtype=np.float64).reshape(-1, 3) - self.middle) / self.size


def parts(scene: Scene, hits: Hits | None, answers: Any, theirs: Any, frame: Frame) -> Iterator[Part]:
    """Yield all parts of the view of a scene with the given answers and, of the reference, `theirs`, or None."""
    yield from _shapes(scene, hits, frame)
    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    if _near(eye, frame):
        segments, tick = frustum(scene.camera, frame.size)
        yield _lines("camera", "camera", np.concatenate([segments, tick]), frame, color="#1d4e89", line_width=2)
    lights = [np.asarray(light.position, dtype=np.float64) for light in scene.lights]
    if drawn := [frame.inside(light)[0] for light in light_places(scene) if _near(light, frame)]:
        balls = bulbs(drawn, 0.015, around=12)
        yield Part(name="lights", layer="lights", mesh=balls, style={"color": "#f5b700", "lighting": False})
    if hits is not None:
        yield from _measured(hits, answers, theirs, eye, lights, frame)
    yield from _hands(len(lights))


def _shapes(scene: Scene, hits: Hits | None, frame: Frame) -> Iterator[Part]:
    eye = frame.inside(scene.camera.eye)[0]
    patch = np.asarray([scene.camera.target]) if hits is None else hits.points
    balls = sum(isinstance(shape, Sphere) for shape in scene.shapes)
    around = int(np.clip(np.sqrt(0.75 * MOST_TRIANGLES / max(1, balls)), LEAST_ROUND, ROUNDEST))
    for index, shape in enumerate(scene.shapes):
        mesh = surface(shape, patch=patch, margin=0.05 * frame.size, around=around)
        if mesh is None:
            continue
        mesh.points = frame.inside(mesh.points)
        # Normals are made anew: the browser lights one side only, and a mirrored ball would show it its dark one.
        mesh.clear_data()
        if isinstance(shape, Sphere) and np.linalg.det(np.asarray(shape.to_world, dtype=np.float64)[:3, :3]) < 0:
            mesh = mesh.flip_faces()
        budget = MOST_TRIANGLES // len(scene.shapes)
        if not isinstance(shape, Sphere) and mesh.n_cells > budget:
            # A soup of triangles has to be sewn together before it can be thinned.
            mesh = mesh.clean().triangulate().decimate(1 - budget / mesh.n_cells)
        bounds = np.asarray(mesh.bounds).reshape(3, 2)
        # One that the camera is inside of would hide everything.
        surrounds = bool(np.all((bounds[:, 0] < eye) & (eye < bounds[:, 1])))
        flat = mesh.n_cells < 50
        color = np.clip(np.asarray(shape.albedo) * 0.6 + 0.35, 0, 1)
        style: MeshStyle = {
            "color": color, "opacity": 0.18 if surrounds else 1.0, "smooth_shading": not flat,
            "show_edges": flat, "edge_color": "#5b6570",
        }  # fmt: skip
        yield Part(name=f"shape {index}", layer="geometry", mesh=mesh, style=style)


def _measured(
    hits: Hits, answers: Any, theirs: Any, eye: np.ndarray, lights: list[np.ndarray], frame: Frame
) -> Iterator[Part]:
    """Yield what hangs on hit points: the points, rays, feelers and normals."""
    import pyvista

    yield _lines("rays", "rays", ray_ends(eye, few(hits.points, RAYS), frame.size), frame, color="#b8860b", opacity=0.7)
    yield from _feelers(hits, answers, lights, frame)
    cloud = pyvista.PolyData(frame.inside(hits.points))
    cloud["value"] = np.linspace(
        0, 1, len(hits.points), dtype=np.float32
    )  # the page overwrites it with what it is asked to show
    yield Part(
        name="points", layer="points", mesh=cloud,
        style={"scalars": "value", "cmap": "viridis", "clim": (0.0, 1.0), "point_size": 5, "lighting": False,
               "show_scalar_bar": False},
    )  # fmt: skip
    some = few(np.arange(len(hits.points)), MOST_NORMALS)
    both = [("ours", hits.normals, 0.05, "#c0392b")]
    if theirs and Stage.NORMAL in theirs:
        # A little longer, so that it shows where they agree.
        both.append(("reference", hits.of(theirs[Stage.NORMAL]).astype(np.float64), 0.065, "#0b5cad"))
    for name, normals, length, color in both:
        unit = some[np.isfinite(normals[some]).all(axis=-1) & (np.linalg.norm(normals[some], axis=-1) > 0.5)]
        if len(unit):
            ends = np.stack([hits.points[unit], hits.points[unit] + length * frame.size * normals[unit]], axis=1)
            yield _lines(f"normals of {name}", f"normals, {name}", ends, frame, color=color)


def _feelers(hits: Hits, answers: Any, lights: list[np.ndarray], frame: Frame) -> Iterator[Part]:
    """Yield lines from some hits to the lights, those that arrive and those that do not."""
    if Stage.VISIBILITY not in answers or not lights:
        return
    some = few(np.arange(len(hits.points)), RAYS)
    visible = hits.of(answers[Stage.VISIBILITY])[some] > 0
    shown = np.linspace(0, len(lights) - 1, min(len(lights), MOST_LIGHTS)).astype(int)
    if visible.shape[1] < len(lights):
        return
    pairs = [(hits.points[one], lights[light]) for one in some for light in shown]
    arrived = visible[:, shown].reshape(-1)
    for name, wanted, color in (("lit", True, "#0072b2"), ("blocked", False, "#d55e00")):
        chosen = [pair for pair, arrives in zip(pairs, arrived, strict=True) if bool(arrives) is wanted]
        if chosen:
            ends = np.asarray(chosen, dtype=np.float64)
            length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1, keepdims=True)
            # Towards a light far away only the first stretch.
            reach = np.minimum(1, 2 * frame.size / np.maximum(length, 1e-300))
            ends[:, 1] = ends[:, 0] + (ends[:, 1] - ends[:, 0]) * reach
            yield _lines(f"feelers, {name}", f"feelers, {name}", ends, frame, color=color, opacity=0.7)


def _hands(lights: int) -> Iterator[Part]:
    """Yield the lines and the point that the page moves: to begin with all of them at the middle, and hidden."""
    import pyvista

    wanted = {"ray": (1, "#e6007e"), "lit": (lights, "#0072b2"), "blocked": (lights, "#d55e00"),
              "ours": (1, "#c0392b"), "reference": (1, "#0b5cad")}  # fmt: skip
    for name, (count, color) in wanted.items():
        if count:
            mesh = pyvista.line_segments_from_points(np.zeros((2 * count, 3), dtype=np.float32))
            yield Part(name=f"pixel {name}", layer="pixel", mesh=mesh, plain={"color": color, "line_width": 3})
    point = pyvista.PolyData(np.zeros((1, 3), dtype=np.float32))
    yield Part(
        name="pixel point",
        layer="pixel",
        mesh=point,
        plain={"color": "#e6007e", "point_size": 11, "lighting": False},
    )


def _near(point: np.ndarray, frame: Frame) -> bool:
    return float(np.linalg.norm(frame.inside(point))) < FAR


def _lines(name: str, layer: str, ends: np.ndarray, frame: Frame, **style: Unpack[LineStyle]) -> Part:
    import pyvista

    mesh = pyvista.line_segments_from_points(frame.inside(ends))
    return Part(name=name, layer=layer, mesh=mesh, plain=style)
