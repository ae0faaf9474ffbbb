"""A view's parts drawn by PyVista (Sullivan and Kaszynski, 2019), in a notebook or a child process.

A plotter is made only in a process that may crash, because OpenGL may end it. The stills of a run are drawn by
`python -m rayproof.reports.publish.scene3d.plotting PARENT`, with one job per line on stdin and one report per line on
stdout.
"""

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.placement import frame
from rayproof.cases.scene import Camera
from rayproof.cases.scene_json import load_scene
from rayproof.cases.stages import FACTS, Stage
from rayproof.reports.processes.signals import end_with_parent
from rayproof.reports.publish.scene3d.parts import Part, SceneView, ball, look, view_of
from rayproof.reports.publish.scene3d.stills import DIGEST, compared, drawing_environment, why_not
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.files import replacing
from rayproof.reports.results.images import kept_images

COLOURS = 160  # in a still's palette
BAR = {
    "title_font_size": 13, "label_font_size": 12, "color": "#222222", "fmt": "%.1f", "render": False,
    "position_x": 0.2, "position_y": 0.02, "width": 0.6, "height": 0.09, "fill": True, "background_color": "#f3f5f8",
}  # fmt: skip


def open_view(folder: Path, case: CaseRecord) -> Any:
    """Return PyVista's view of a case's scene in a notebook: interactive if trame is installed, otherwise an image.

    Raises:
        RuntimeError: OpenGL is missing.

    """
    if (why := why_not()) is not None:
        raise RuntimeError(why)
    import pyvista

    os.environ.update(drawing_environment())
    plotter = pyvista.Plotter(notebook=True, off_screen=True, window_size=list(look().still), lighting="none")
    fill(plotter, folder, case)
    return plotter.show(return_viewer=True)


def new_plotter() -> Any:
    """Return an empty plotter for any number of stills; making a plotter takes longer than drawing."""
    import pyvista

    return pyvista.Plotter(off_screen=True, window_size=list(look().still), lighting="none")


def fill(plotter: Any, folder: Path, case: CaseRecord) -> None:
    """Show a case of a results folder in a plotter, with the scene and the images of its record."""
    subject, reference = compared(case)
    images, _ = kept_images(folder, case, only=(subject, reference))
    scene = load_scene(folder / str(case["scene"]))
    view = view_of(scene, images.get(subject or ""), images.get(reference or ""), case["stage"])
    _show(plotter, view, scene.camera)


def _show(plotter: Any, view: SceneView, camera: Camera) -> None:
    import pyvista

    plotter.clear()
    # A plain background, because a gradient triples the size of the file and the time to write it.
    plotter.set_background(look().background[0])
    plotter.add_light(pyvista.Light(light_type="headlight"))
    for part in view.parts:
        plotter.add_actor(_actor(plotter, part, view), name=part.name, reset_camera=False, render=False)
    right, up, forward = frame(camera.eye, camera.target, camera.up)
    aim = look().camera
    direction = aim.direction[0] * forward + aim.direction[1] * right + aim.direction[2] * up
    plotter.camera.focal_point = (0.0, 0.0, 0.0)
    plotter.camera.position = tuple(direction / np.linalg.norm(direction) * aim.distance)
    plotter.camera.up = tuple(up)
    plotter.camera.view_angle = aim.angle
    plotter.renderer.ResetCameraClippingRange()


def _actor(plotter: Any, part: Part, view: SceneView) -> Any:
    """Return a part as an actor, without the general method `add_mesh`, which takes six times as long."""
    import pyvista
    from vtkmodules.vtkRenderingCore import vtkMapper

    vtkMapper.SetResolveCoincidentTopologyToPolygonOffset()
    layer, corners = look().layers[part.layer], part.cells.shape[1]
    cells = np.insert(part.cells, 0, corners, axis=1).ravel()
    of_kind: dict[str, Any] = {{1: "verts", 2: "lines"}.get(corners, "faces"): cells}
    mesh = pyvista.PolyData(part.points.astype(np.float32), **of_kind)
    if part.normals is not None:
        mesh.point_data.active_normals = part.normals.astype(np.float32)
    mapper = pyvista.DataSetMapper(mesh)
    mapper.scalar_visibility = False
    if part.layer == "geometry":
        # Points and lines on a surface are drawn in front of it, at any slope of the surface.
        mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(4, 4)
    if part.shares is not None:
        low, high = view.range or (0.0, 0.0)
        values, title = low + part.shares * (high - low), _title(view.colored)
        mapper.set_scalars(values, title, cmap=look().colors, clim=(low, max(high, low + 1e-6)))
        mapper.scalar_visibility = True
        if view.range is not None:
            plotter.add_scalar_bar(title, mapper=mapper, **BAR)
    lit = part.layer == "geometry"
    shape = look().shape
    appearance = pyvista.Property(
        color=part.color or layer.color[0],
        opacity=part.opacity,
        line_width=layer.width,
        point_size=layer.width,
        interpolation="Flat" if part.normals is None else "Phong",
        ambient=shape.ambient if lit else 0.0,
        diffuse=shape.diffuse if lit else 1.0,
        specular=0.0,
        lighting=lit,
        show_edges=part.edges and lit,
        edge_color=shape.edges,
    )
    return pyvista.Actor(mapper=mapper, prop=appearance)


def _title(stage: Stage | None) -> str:
    unit = "1" if stage is None else FACTS[stage].unit
    return f"log10 of the {stage} error" + (f" [{unit}]" if unit != "1" else "")


def write_still(plotter: Any, path: Path, digest: str) -> None:
    """Write a plotter's image as a PNG file that contains the digest of its inputs."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    # A plotter that was shown before would reuse its last image for the screenshot without this call.
    plotter.render()
    picture = Image.fromarray(plotter.screenshot(return_img=True)).convert("RGB")
    about = PngInfo()
    about.add_text(DIGEST, digest)
    with replacing(path) as draft:
        # The image has few colours, and a palette reduces the file to a third. A higher compression level would save
        # another 5 % and take five times as long.
        picture.quantize(COLOURS, dither=Image.Dither.NONE).save(draft, format="PNG", compress_level=6, pnginfo=about)


def _ball(plotter: Any) -> None:
    """Draw a ball as a test of OpenGL; raise ValueError if the image is blank."""
    import pyvista

    shape = ball(12)
    plotter.add_mesh(pyvista.PolyData(shape.points, faces=np.insert(shape.cells, 0, 4, axis=1).ravel()), color="red")
    if plotter.screenshot(return_img=True).std() <= 1:
        raise ValueError("the image is blank")


def main() -> None:
    """Draw every job of stdin; end when the parent ends, whose process number is the argument."""
    for parent in sys.argv[1:]:
        end_with_parent(int(parent), "rayproof-draw")
    plotter = new_plotter()
    for line in sys.stdin:
        job = json.loads(line)
        why = None
        try:
            if job is None:
                _ball(plotter)
            else:
                folder = Path(job["folder"])
                fill(plotter, folder, job["case"])
                write_still(plotter, folder / job["picture"], job["digest"])
        except (OSError, ValueError) as error:
            why = str(error)
        sys.stdout.write(json.dumps({"name": "" if job is None else job["case"]["name"], "why": why}) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
