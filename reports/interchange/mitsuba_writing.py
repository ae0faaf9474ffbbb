"""Export of a scene as Mitsuba 3 XML, with meshes as PLY files in the same folder.

Mitsuba renders a stretched or sheared sphere wrongly and turns the normals of mirrored shapes; as instances of a group
both are right. An infinite plane becomes a disc that extends beyond everything the camera can see.
"""

from collections.abc import Callable, Sequence
from math import pi
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import trimesh
from trimesh.exchange.ply import export_ply

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Rgb, Scene, SceneError, Shape, Sphere, Square, Triangle
from rayproof.reference.mitsuba3.scene import disc_to_world, needs_instance, split_scale
from rayproof.reports.interchange import EXPORTERS, SceneFormat
from rayproof.reports.interchange.mitsuba_scene import PLANE
from rayproof.reports.results.files import replacing, write_text

HALF = np.diag([0.5, 0.5, 0.5, 1.0])
PLUGINS = {Sphere: "sphere", Cube: "cube", Square: "rectangle"}


SAYS = SceneFormat(
    title="Mitsuba 3 XML",
    shading=("inverse_square",),
    clip=("depth",),
    greatest_albedo=1.0,
    lights=1,
    world_normals=True,
    program="mitsuba_scalar",
    cannot_say={
        "clip `shell` and `none`": "clip `depth`, if the planes touch nothing; else `unsupported`",
        "simplified light": "`inverse_square`",
        "an albedo above 1": "`unsupported`",
        "an infinite plane": "a disk that reaches beyond all that the camera sees",
        "a sum over lights without noise (`direct` samples one of them)": "one render for each light, added",
    },
)


@EXPORTERS.register(".xml", says=SAYS)
def export_mitsuba(scene: Scene, path: Path) -> tuple[str, ...]:
    """Write `scene` to `path`, and its meshes to the same folder; return sentences about features that Mitsuba lacks.

    Raises:
        OSError: a file cannot be written.

    """
    dropped: list[str] = []
    root = Element("scene", version="3.0.0")
    integrator = SubElement(root, "integrator", type="direct")
    for name, count in (("emitter_samples", 1), ("bsdf_samples", 0)):
        _value(integrator, "integer", name, count)
    _sensor(root, scene)
    for index, shape in enumerate(scene.shapes):
        _shape(root, shape, index, scene, path, dropped.append)
    for light in scene.lights:
        emitter = SubElement(root, "emitter", type="point")
        x, y, z = map(_number, light.position)
        SubElement(emitter, "point", name="position", x=x, y=y, z=z)
        _rgb(emitter, "intensity", [flux / (4 * pi) for flux in light.flux])
    if scene.shading != "inverse_square":
        dropped.append("the simplified shading: Mitsuba's light falls off with the square of the distance")
    if scene.clip != "depth":
        dropped.append(f"clip {scene.clip}: Mitsuba clips between two planes")
    if len(scene.lights) > 1:
        dropped.append(f"of the {len(scene.lights)} lights Mitsuba samples one a path: give it many samples per pixel")
    indent(root)
    write_text(path, tostring(root, encoding="unicode") + "\n")
    return tuple(dropped)


def _number(value: float) -> str:
    return repr(float(value))


def _numbers(values: Sequence[float]) -> str:
    return ", ".join(map(_number, values))


def _value(parent: Element, kind: str, name: str, value: object) -> None:
    SubElement(parent, kind, name=name, value=str(value))


def _rgb(parent: Element, name: str, values: Sequence[float]) -> None:
    _value(parent, "rgb", name, _numbers(values))


def _sensor(root: Element, scene: Scene) -> None:
    camera = scene.camera
    sensor = SubElement(root, "sensor", type="perspective")
    for name, value in (("fov", camera.fovy), ("near_clip", camera.near), ("far_clip", camera.far)):
        _value(sensor, "float", name, _number(value))
    _value(sensor, "string", "fov_axis", "y")
    places = {"origin": camera.eye, "target": camera.target, "up": camera.up}
    transform = SubElement(sensor, "transform", name="to_world")
    SubElement(transform, "lookat", {name: _numbers(value) for name, value in places.items()})
    film = SubElement(sensor, "film", type="hdrfilm")
    for name in ("width", "height"):
        _value(film, "integer", name, getattr(camera, name))
    for name, value in (("pixel_format", "rgb"), ("component_format", "float32")):
        _value(film, "string", name, value)
    SubElement(film, "rfilter", type="box")
    # Without jitter one sample is the pixel's centre.
    sampler = SubElement(sensor, "sampler", type="stratified")
    _value(sampler, "integer", "sample_count", 1)
    _value(sampler, "boolean", "jitter", "false")


def _shape(root: Element, shape: Shape, index: int, scene: Scene, path: Path, drop: Callable[[str], None]) -> None:
    to_world = np.asarray(shape.to_world, dtype=np.float64)
    albedo = _albedo(shape.albedo, index, drop)
    if isinstance(shape, Triangle | Mesh):
        file = path.with_name(f"{path.stem}-{index}.ply")
        _write_ply(file, world_triangles(shape))
        element = SubElement(root, "shape", type="ply")
        _value(element, "string", "filename", file.name)
        _value(element, "boolean", "face_normals", "true")
    elif isinstance(shape, Plane):
        drop(f"shape {index}: the plane's infinity; it is a disc beyond all that the camera sees")
        element = SubElement(root, "shape", type="disk", id=f"{PLANE}-{index}")
        _transform(element, disc_to_world(shape, scene))
    elif needs_instance(shape):
        group = SubElement(root, "shape", type="shapegroup", id=f"group-{index}")
        within, around = split_scale(shape)
        element = _primitive(group, shape, within)
        instance = SubElement(root, "shape", type="instance")
        SubElement(instance, "ref", id=f"group-{index}")
        _transform(instance, around)
    else:
        element = _primitive(root, shape, to_world)
    material = element
    if shape.two_sided:
        material = SubElement(element, "bsdf", type="twosided")
    _rgb(SubElement(material, "bsdf", type="diffuse"), "reflectance", albedo)


def _albedo(albedo: Rgb, index: int, drop: Callable[[str], None]) -> list[float]:
    if max(albedo) > 1:
        drop(f"shape {index}: an albedo above 1, {albedo}; Mitsuba refuses it, and it is cut to 1")
    return [min(channel, 1.0) for channel in albedo]


def _primitive(parent: Element, shape: Shape, to_world: np.ndarray) -> Element:
    if type(shape) not in PLUGINS:
        raise SceneError(f"Mitsuba's XML has no word for a {type(shape).__name__}")
    element = SubElement(parent, "shape", type=PLUGINS[type(shape)])
    if isinstance(shape, Sphere):
        x, y, z = map(_number, shape.center)
        SubElement(element, "point", name="center", x=x, y=y, z=z)
        _value(element, "float", "radius", _number(shape.radius))
        _transform(element, to_world)
    else:
        _transform(element, to_world @ HALF)
    return element


def _transform(element: Element, matrix: np.ndarray) -> None:
    entries = " ".join(map(_number, matrix.ravel()))
    SubElement(SubElement(element, "transform", name="to_world"), "matrix", value=entries)


def _write_ply(file: Path, corners: np.ndarray) -> None:
    """Write baked float32 triangles (faces, 3, 3) [m] unchanged, three vertices per face, without normals."""
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), process=False)
    with replacing(file) as draft:
        draft.write_bytes(export_ply(mesh, vertex_normal=False))
