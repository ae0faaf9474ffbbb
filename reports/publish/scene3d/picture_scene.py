"""One scene as a 600 x 450 picture: geometry, camera frustum, rays, hit points coloured by error, normals, lights.

Drawn with PyVista (Sullivan and Kaszynski, 2019), imported inside: only a process that may die of OpenGL calls this.
"""

from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.scene import Camera, Scene
from rayproof.cases.stages import Stage
from rayproof.reports.publish.scene3d.picture_hits import absolute_error, chosen_hits, colored_stage, title_of
from rayproof.reports.publish.scene3d.picture_lines import add_lines
from rayproof.reports.publish.scene3d.picture_places import basis, few, framing, frustum, ray_ends
from rayproof.reports.publish.scene3d.picture_shapes import surface
from rayproof.reports.results.atomic import replacing

SIZE = (600, 450)  # px
COLOURS = 160  # of a picture's palette
MOST_NORMALS = 50
MOST_LIGHTS = 64  # that are drawn: a thousand balls hide what they light, and take as long as all else
NO_ERROR = 1e-16  # drawn where no pixel has an error at all, which has no logarithm


def new_plotter() -> Any:
    """Return an empty plotter; one serves any number of pictures, since making one costs more than drawing."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=list(SIZE))
    # A plain background: a gradient trebles the size of the file and the time to write it.
    plotter.renderer.set_background("#f3f5f8")
    return plotter


def draw(plotter: Any, path: Path, scene: Scene, *, ours: Any, theirs: Any, stage: str | None) -> None:
    """Write the picture of `scene`; `ours` and `theirs` are answers as `read_answers` gives them, or None."""
    plotter.clear()
    plotter.enable_3_lights()
    _fill(plotter, scene, ours=ours, theirs=theirs, stage=stage)
    # A plotter that has been shown once takes its last image for the screenshot unless told to draw.
    plotter.render()
    from PIL import Image

    picture = Image.fromarray(plotter.screenshot(return_img=True)).convert("RGB")
    with replacing(path) as draft:
        # Few colours are in it; a palette of them takes a third of the file. Compressing harder would save a twentieth
        # of it, and take five times as long.
        picture.quantize(COLOURS, dither=Image.Dither.NONE).save(draft, compress_level=6)


def _fill(plotter: Any, scene: Scene, *, ours: Any, theirs: Any, stage: str | None) -> None:
    import pyvista

    eye = np.asarray(scene.camera.eye, dtype=np.float64)
    colored = colored_stage(ours, theirs, stage)
    errors = None if colored is None else _log_errors(ours, theirs, colored)
    hits = chosen_hits(ours, theirs, errors)
    points = np.empty((0, 3)) if hits is None else hits.points
    focus, extent = framing(scene, points)
    _add_shapes(plotter, scene, points, eye, extent)
    _add_camera(plotter, scene.camera, extent)
    rays = ray_ends(eye, few(points), extent)
    if len(rays):
        _add_lines(plotter, pyvista.line_segments_from_points(rays), color="#b8860b", line_width=1, opacity=0.6)
    if hits is not None:
        shown = None if errors is None else hits.of(errors)
        _add_hits(plotter, points, hits.normals, shown, title_of(colored) if colored else "", extent)
    if scene.lights:
        _add(plotter, bulbs(light_places(scene), 0.02 * extent), color="#f5b700", lighting=False)
    aim(plotter, scene.camera, focus, extent)


def light_places(scene: Scene) -> list[np.ndarray]:
    """Return where the lights are that are drawn [m]: of many at most `MOST_LIGHTS`, evenly spaced in their list."""
    numbers = np.linspace(0, len(scene.lights) - 1, min(len(scene.lights), MOST_LIGHTS)).astype(int)
    return [np.asarray(scene.lights[number].position, dtype=np.float64) for number in numbers]


def bulbs(places: list[np.ndarray], radius: float, *, around: int = 30) -> Any:
    """Return one mesh of balls at places, with `around` corners of an equator."""
    import pyvista

    balls = [
        pyvista.Sphere(radius=radius, center=place, theta_resolution=around, phi_resolution=max(8, 2 * around // 3))
        for place in places
    ]
    return pyvista.merge(balls) if len(balls) > 1 else balls[0]


def _log_errors(ours: Any, theirs: Any, stage: Stage) -> np.ndarray:
    """Return log10 of the error (height, width)."""
    difference = absolute_error(ours, theirs, stage)
    # NaN and infinities are worse than any number and take the top of the scale; no error takes its bottom.
    known = difference[np.isfinite(difference) & (difference > 0)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (NO_ERROR, NO_ERROR)
    return np.log10(np.where(np.isfinite(difference), np.maximum(difference, low), high))


def _add(plotter: Any, mesh: Any, **style: Any) -> None:
    """Add a mesh under a name of its own, without drawing yet.

    By default PyVista names an actor after its mesh's address, which the next mesh may get: it would replace it.
    """
    plotter.add_mesh(mesh, name=f"part {len(plotter.renderer.actors)}", render=False, **style)


def _add_lines(plotter: Any, mesh: Any, **style: Any) -> None:
    add_lines(plotter, mesh, name=f"part {len(plotter.renderer.actors)}", **style)


def _add_shapes(plotter: Any, scene: Scene, points: np.ndarray, eye: np.ndarray, extent: float) -> None:
    for shape in scene.shapes:
        mesh = surface(shape, patch=points if len(points) else np.asarray([scene.camera.target]), margin=0.05 * extent)
        if mesh is None:
            continue
        bounds = np.asarray(mesh.bounds).reshape(3, 2)
        # One that the camera is inside of would hide everything.
        around = bool(np.all((bounds[:, 0] < eye) & (eye < bounds[:, 1])))
        color = np.clip(np.asarray(shape.albedo) * 0.6 + 0.35, 0, 1)
        flat = mesh.n_cells < 50
        _add(
            plotter,
            mesh,
            color=color,
            opacity=0.18 if around else 0.8,
            smooth_shading=not flat,
            show_edges=flat,
            edge_color="#5b6570",
        )


def _add_camera(plotter: Any, camera: Camera, extent: float) -> None:
    """Add the frustum as lines from the eye, as deep as a sixth of the scene."""
    import pyvista

    segments, tick = frustum(camera, extent)
    _add_lines(plotter, pyvista.line_segments_from_points(segments), color="#1d4e89", line_width=2)
    _add_lines(plotter, pyvista.Line(*tick), color="#1d4e89", line_width=3)


def _add_hits(plotter: Any, points: np.ndarray, normals: np.ndarray, errors: Any, title: str, extent: float) -> None:
    import pyvista

    cloud = pyvista.PolyData(points)
    if errors is None:
        _add(plotter, cloud, color="#333333", point_size=4)
    else:
        cloud[title] = errors
        _add(
            plotter,
            cloud,
            scalars=title,
            cmap="viridis",
            clim=(float(errors.min()), max(float(errors.max()), float(errors.min()) + 1e-6)),
            point_size=4.5,
            render_points_as_spheres=True,
            lighting=False,
            scalar_bar_args={
                "title_font_size": 13, "label_font_size": 12, "color": "#222222", "fmt": "%.1f",
                "render": False, "position_x": 0.2, "position_y": 0.02, "width": 0.6, "height": 0.09,
            },
        )  # fmt: skip
    some = np.linspace(0, len(points) - 1, min(len(points), MOST_NORMALS)).astype(int)
    unit = some[np.linalg.norm(normals[some], axis=-1) > 0.5]
    unit = unit[np.isfinite(normals[unit]).all(axis=-1)]
    if len(unit):
        ends = points[unit] + 0.05 * extent * normals[unit]
        segments = np.stack([points[unit], ends], axis=1).reshape(-1, 3)
        _add_lines(plotter, pyvista.line_segments_from_points(segments), color="#c0392b", line_width=1.5)


def aim(plotter: Any, camera: Camera, focus: np.ndarray, extent: float) -> None:
    """Look from beside and above the scene's own camera, so that both it and what it sees are in view."""
    _, forward, right, up = basis(camera)
    direction = -0.75 * forward + 0.75 * right + 0.5 * up
    plotter.camera.focal_point = tuple(focus)
    plotter.camera.position = tuple(focus + direction / np.linalg.norm(direction) * 1.7 * extent)
    plotter.camera.up = tuple(up)
    plotter.camera.view_angle = 30.0
    plotter.renderer.ResetCameraClippingRange()
