"""Starting a Python with Blender's bpy, and the script in it that sets up Cycles and renders a task.

`bpy` is never imported here: it takes a second, 400 MB, and cannot be unloaded.
"""

import importlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

VARIABLE = "RAYPROOF_BLENDER_PYTHON"
INSTALL = (
    f"Cycles is not installed; pip install bpy into an environment of a Python that it is made for, and set {VARIABLE}"
    " to that environment's python."
)
SCRIPT = Path(__file__).with_name("inside.py")


def interpreter() -> str | None:
    """Return the path of a Python that has bpy, or None."""
    if named := os.environ.get(VARIABLE):
        return named if Path(named).is_file() else None
    return sys.executable if find_spec("bpy") is not None else None


def missing() -> str | None:
    """Return how to install it, or None if it is there."""
    return INSTALL if interpreter() is None else None


@cache
def version() -> str:
    """Return program and version."""
    said = _run(["-c", "import bpy; print('Blender', bpy.app.version_string)"])
    found = re.search(r"Blender (\d\S*)", said)
    if found is None:
        raise RuntimeError(f"bpy names no version: {said.strip()[-200:]!r}")
    return f"Cycles of Blender {found[1]}"


@contextmanager
def workshop() -> Iterator[Path]:
    """Yield a folder, and remove it with all that was written there."""
    with tempfile.TemporaryDirectory(prefix="rayproof-cycles-") as name:
        yield Path(name)


def render(folder: Path) -> None:
    """Render the task that lies in `folder`.

    Raises:
        RuntimeError: it failed; the message ends with what Blender said.

    """
    _run([str(SCRIPT), str(folder)], home=folder)


def _run(arguments: list[str], home: Path | None = None) -> str:
    python = interpreter()
    if python is None:
        raise RuntimeError(INSTALL)
    # Home is the workshop too: no settings of the user's, and nothing left behind among them.
    extra = {} if home is None else {"HOME": str(home), "BLENDER_USER_RESOURCES": str(home / "blender")}
    ended = subprocess.run(
        [python, "-I", *arguments],
        env={**os.environ, **extra},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    if ended.returncode != 0:
        raise RuntimeError(f"Blender's Python ended with {ended.returncode}: {ended.stdout.strip()[-500:]}")
    return ended.stdout


# What Blender's own Python runs: it reads task.json and its arrays, and writes one EXR per picture of Cycles.
#
# It is started by path in a process of its own and imports nothing of this project; `bpy` exists only there.


# Passes that Cycles has, and outputs of our own that every material writes.
AOVS = ("shape", "face", "back")


def main(folder: Path) -> None:
    """Render the task in `folder`."""
    bpy: Any = importlib.import_module("bpy")
    numpy: Any = importlib.import_module("numpy")
    task = json.loads((folder / "task.json").read_text(encoding="ascii"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    _settings(bpy, scene, task)
    _camera(bpy, scene, task["camera"])
    for index, shape in enumerate(task["shapes"]):
        material = _material(bpy, index, shape)
        if shape["kind"] == "ball":
            _ball(bpy, scene, shape, material)
        else:
            arrays = numpy.load(folder / shape["file"])
            _facets(bpy, scene, arrays["corners"], arrays["faces"], material)
    lights = [_light(bpy, scene, light) for light in task["lights"]]
    for name, light in task["pictures"].items():
        for number, lamp in enumerate(lights):
            lamp.hide_render = number != light
        scene.render.filepath = str(folder / name)
        bpy.ops.render.render(write_still=True)


def _settings(bpy: Any, scene: Any, task: dict[str, Any]) -> None:
    scene.render.engine = "CYCLES"
    for name, value in task["cycles"].items():
        setattr(scene.cycles, name, value)
    scene.render.resolution_x, scene.render.resolution_y = task["camera"]["size"]
    scene.render.resolution_percentage = 100
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.use_persistent_data = False
    image = scene.render.image_settings
    if hasattr(image, "media_type"):  # from 5.0 on
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth, image.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    scene.view_settings.view_transform = "Raw"
    # A new world shines; one without nodes does not.
    scene.world = bpy.data.worlds.new("dark")
    _nodes(scene.world)
    layer = scene.view_layers[0]
    layer.use_pass_position = layer.use_pass_normal = True
    for name in AOVS:
        output = layer.aovs.add()
        output.name, output.type = name, "VALUE"


def _camera(bpy: Any, scene: Any, camera: dict[str, Any]) -> None:
    data = bpy.data.cameras.new("camera")
    data.sensor_fit, data.angle = "VERTICAL", camera["fovy"]
    data.clip_start, data.clip_end = camera["near"], camera["far"]
    # The sample lies 1/2048 pixel off the centre.
    data.shift_x = data.shift_y = -1 / 2048 / camera["size"][1]
    thing = bpy.data.objects.new("camera", data)
    # Nested lists would be taken column by column.
    thing.matrix_world = importlib.import_module("mathutils").Matrix(camera["matrix"])
    scene.collection.objects.link(thing)
    scene.camera = thing


def _light(bpy: Any, scene: Any, light: dict[str, Any]) -> Any:
    data = bpy.data.lights.new("light", "POINT")
    data.energy, data.color, data.shadow_soft_size = light["energy"], light["color"], 0.0
    thing = bpy.data.objects.new("light", data)
    thing.location = light["position"]
    scene.collection.objects.link(thing)
    return thing


def _material(bpy: Any, index: int, shape: dict[str, Any]) -> Any:
    """Return a diffuse material, black from behind if one-sided, that writes our outputs."""
    material = bpy.data.materials.new(f"shape {index}")
    tree = _nodes(material)
    new, link = tree.nodes.new, tree.links.new
    geometry, face, number = new("ShaderNodeNewGeometry"), new("ShaderNodeAttribute"), new("ShaderNodeValue")
    face.attribute_name = "face"
    number.outputs[0].default_value = index + 1
    sources = {"shape": number.outputs[0], "face": face.outputs["Fac"], "back": geometry.outputs["Backfacing"]}
    for name, source in sources.items():
        output = new("ShaderNodeOutputAOV")
        output.aov_name = name
        link(source, output.inputs["Value"])
    front, back, mix, surface = (
        new(kind)
        for kind in (
            "ShaderNodeBsdfDiffuse",
            "ShaderNodeBsdfDiffuse",
            "ShaderNodeMixShader",
            "ShaderNodeOutputMaterial",
        )
    )
    front.inputs["Color"].default_value = (*shape["albedo"], 1.0)
    back.inputs["Color"].default_value = (*(shape["albedo"] if shape["two_sided"] else (0.0, 0.0, 0.0)), 1.0)
    link(geometry.outputs["Backfacing"], mix.inputs[0])
    link(front.outputs[0], mix.inputs[1])
    link(back.outputs[0], mix.inputs[2])
    link(mix.outputs[0], surface.inputs["Surface"])
    return material


def _nodes(thing: Any) -> Any:
    """Return the node tree of a material or world, emptied."""
    # From 5.0 on there always is one, and the switch is to go.
    has_one = thing.node_tree is not None
    if not has_one:
        thing.use_nodes = True
    thing.node_tree.nodes.clear()
    return thing.node_tree


def _facets(bpy: Any, scene: Any, corners: Any, faces: Any, material: Any) -> None:
    """Add flat triangles, each with vertices of its own."""
    data = bpy.data.meshes.new("facets")
    count = len(corners)
    data.vertices.add(3 * count)
    data.vertices.foreach_set("co", corners.reshape(-1))
    data.loops.add(3 * count)
    data.loops.foreach_set("vertex_index", list(range(3 * count)))
    data.polygons.add(count)
    data.polygons.foreach_set("loop_start", list(range(0, 3 * count, 3)))
    data.update()
    # Or a face's normal would come by its vertices' normals, with a digit less.
    data.shade_flat()
    data.attributes.new("face", "FLOAT", "FACE").data.foreach_set("value", faces)
    data.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("facets", data))


def _ball(bpy: Any, scene: Any, shape: dict[str, Any], material: Any) -> None:
    """Add a point of a point cloud, which Cycles renders as a true sphere."""
    group = bpy.data.node_groups.new("ball", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    points, paint, out = (
        group.nodes.new(kind) for kind in ("GeometryNodePoints", "GeometryNodeSetMaterial", "NodeGroupOutput")
    )
    points.inputs["Count"].default_value = 1
    points.inputs["Position"].default_value = shape["center"]
    points.inputs["Radius"].default_value = shape["radius"]
    paint.inputs["Material"].default_value = material
    group.links.new(points.outputs[0], paint.inputs["Geometry"])
    group.links.new(paint.outputs[0], out.inputs[0])
    thing = bpy.data.objects.new("ball", bpy.data.meshes.new("ball"))
    thing.modifiers.new("ball", "NODES").node_group = group
    scene.collection.objects.link(thing)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
