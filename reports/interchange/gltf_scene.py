"""Import of glTF scenes: triangles, perspective cameras, point lights, base colours.

The supported extensions are KHR_lights_punctual (Khronos 2018; only point lights) and KHR_mesh_quantization.
"""

from collections.abc import Callable, Iterator
from math import degrees, pi
from pathlib import Path
from typing import Any, Final

import numpy as np

from rayproof.cases.gltf_document import (
    AnimationEntry,
    CameraEntry,
    Document,
    MaterialEntry,
    MeshEntry,
    PrimitiveEntry,
    SceneEntry,
    placed_nodes,
    read_document,
)
from rayproof.cases.gltf_meshes import DRACO, FAN, STRIP, TRIANGLES, primitive_mesh
from rayproof.cases.scene import Camera, Mesh, PointLight, Rgb, Scene, SceneError, shown
from rayproof.reports.interchange import IMPORTERS, Imported, ImportOptions, Size
from rayproof.reports.interchange.framing import SIZE, camera_for, light_for, matrix, vector

LIGHTS: Final = "KHR_lights_punctual"
UNDERSTOOD = (LIGHTS, "KHR_mesh_quantization")


@IMPORTERS.register(".glb")
@IMPORTERS.register(".gltf")
def import_gltf(path: Path, options: ImportOptions) -> Imported:
    """Return the default scene of a glTF file.

    Raises:
        SceneError: the file is malformed, or has a value that the specification refuses.

    """
    dropped: dict[str, None] = {}

    def drop(sentence: str) -> None:
        dropped[f"{path.name}: {sentence}"] = None

    try:
        return Imported(scene=_scene(read_document(path), options.size, drop), dropped=tuple(dropped))
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None
    except (TypeError, AttributeError, KeyError, ValueError, OverflowError) as error:
        # Members of other types than glTF's: JSON may contain anything.
        raise SceneError(f"{path}: is not glTF: {' '.join(str(error).split())}") from None


def _scene(document: Document, size: Size, drop: Callable[[str], None]) -> Scene:
    required = document.json.get("extensionsRequired", [])
    for name in dict.fromkeys([*required, *document.json.get("extensionsUsed", [])]):
        if name not in UNDERSTOOD:
            drop(f"the extension {shown(name)}{', which it requires' if name in required else ''}")
    meshes: list[Mesh] = []
    cameras: list[Camera] = []
    lights: list[PointLight] = []
    for node, to_world in placed_nodes(document):
        if "skin" in node:
            drop(f"the skin of node {shown(node.get('name', '?'))}; the mesh keeps its pose")
        if "mesh" in node and not np.linalg.det(to_world[:3, :3]):
            name = shown(node.get("name", "?"))
            drop(f"the mesh of node {name}: its matrix is singular, as a scale of 0 makes it, and leaves nothing of it")
        elif "mesh" in node:
            meshes += meshes_of(document, node["mesh"], to_world, drop)
        if "camera" in node:
            view = camera_of(document.one(CameraEntry, node["camera"]), to_world, size, drop)
            cameras += [view] if view else []
        light = node.get("extensions", {}).get(LIGHTS)
        if light is not None:
            lights += _light(document, light, to_world, drop)
    if document.listed(AnimationEntry):
        drop("its animations")
    if (scenes := len(document.listed(SceneEntry))) > 1:
        drop(f"{scenes - 1} of {scenes} scenes; the default one counts")
    if len(cameras) > 1:
        drop(f"{len(cameras) - 1} of {len(cameras)} cameras; the first one counts")
    if not cameras:
        drop("it has no perspective camera; one was made that shows everything")
    camera = cameras[0] if cameras else camera_for(tuple(meshes), size, up="y")
    if not lights:
        drop("it has no point light; one was made")
        light, dark = light_for(camera, tuple(meshes))
        lights = [light]
        if dark:
            drop(dark)
    return Scene(camera=camera, shapes=tuple(meshes), lights=tuple(lights))


def _light(
    document: Document, reference: dict[str, int], to_world: np.ndarray, drop: Callable[[str], None]
) -> list[PointLight]:
    """Return a point light: `intensity` is in candela, taken as W/sr, so the flux is 4 pi times it."""
    lights = document.json.get("extensions", {}).get(LIGHTS, {}).get("lights", [])
    index = reference.get("light")
    if not isinstance(index, int) or not 0 <= index < len(lights):
        raise SceneError(f"{LIGHTS} has {len(lights)} lights, none at {shown(index)}")
    light = lights[index]
    if light.get("type") != "point":
        drop(f"the {light.get('type')} light {shown(light.get('name', index))}")
        return []
    if "range" in light:
        drop(f"the range of the light {shown(light.get('name', index))}; it reaches as far as light does")
    intensity = float(light.get("intensity", 1.0)) * np.asarray(light.get("color", (1.0, 1.0, 1.0)), dtype=np.float64)
    return [PointLight(position=vector(to_world[:3, 3]), flux=vector(4 * pi * intensity))]


# glTF meshes: each primitive of triangles a mesh of its own, its material's base colour as albedo (3.7.2, 3.9).


MODES = ("points", "lines", "a line loop", "a line strip", "triangles", "a triangle strip", "a triangle fan")
# Names of attributes by their prefix (section 3.7.2.1); an attribute with another prefix is specific to an application.
ATTRIBUTES = {
    "NORMAL": "vertex normals; it is shaded by faces",
    "TANGENT": "vertex tangents",
    "TEXCOORD": "texture coordinates",
    "COLOR": "vertex colours; its albedo is the material's base colour",
    "JOINTS": "joints; the mesh keeps its pose",
    "WEIGHTS": "weights of joints; the mesh keeps its pose",
}
TEXTURES = ("normalTexture", "occlusionTexture", "emissiveTexture")
Drop = Callable[[str], None]


def meshes_of(document: Document, index: Any, to_world: np.ndarray, drop: Drop) -> Iterator[Mesh]:
    """Yield the primitives of a mesh, transformed to world space.

    Raises:
        SceneError: glTF or the specification does not allow an array or a value.

    """
    mesh = document.one(MeshEntry, index)
    for number, primitive in enumerate(mesh.get("primitives", [])):
        place = f"mesh {shown(mesh.get('name', index))}, primitive {number}"
        mode = primitive.get("mode", TRIANGLES)
        if mode not in (TRIANGLES, STRIP, FAN):
            drop(f"{place}: it is {MODES[mode] if mode in range(len(MODES)) else f'of the mode {shown(mode)}'}")
            continue
        if DRACO in primitive.get("extensions", {}):
            drop(f"{place}: it is compressed by Draco ({DRACO})")
            continue
        attributes = primitive.get("attributes", {})
        if "targets" in primitive:
            drop(f"{place}: its morph targets")
        for name in attributes:
            if name != "POSITION":
                drop(f"{place}: its {ATTRIBUTES.get(name.partition('_')[0], f'attribute {shown(name)}')}")
        albedo, two_sided = _material(document, primitive, place, drop)
        vertices, faces, corners = primitive_mesh(document, primitive, by=place)
        left = corners - 3 * len(faces) if mode == TRIANGLES else 0
        if left:
            drop(f"{place}: its last {left} vertices, which make no triangle")
        if not len(faces):
            drop(f"{place}: it has {corners} vertices, which make no triangle")
            continue
        yield Mesh(albedo=albedo, two_sided=two_sided, vertices=vertices, faces=faces, to_world=matrix(to_world))


def _material(document: Document, primitive: PrimitiveEntry, place: str, drop: Drop) -> tuple[Rgb, bool]:
    """Return albedo and two-sidedness; glTF's default material is white, metal and one-sided (section 3.9.6)."""
    if "material" not in primitive:
        return (1.0, 1.0, 1.0), False
    material = document.one(MaterialEntry, primitive["material"])
    surface = material.get("pbrMetallicRoughness", {})
    if "baseColorTexture" in surface:
        drop(f"{place}: its base colour's texture")
    if surface.get("metallicFactor", 1.0) != 0:
        drop(f"{place}: its metal; the base colour is the albedo of a diffuse surface")
    if "metallicRoughnessTexture" in surface:
        drop(f"{place}: its texture of metal and roughness")
    if any(material.get("emissiveFactor", ())):
        drop(f"{place}: its emission")
    for name in TEXTURES:
        if name in material:
            drop(f"{place}: its {name}")
    if material.get("alphaMode", "OPAQUE") != "OPAQUE":
        drop(f"{place}: its transparency ({shown(material['alphaMode'])}); it is opaque")
    for name in material.get("extensions", {}):
        drop(f"{place}: the extension {shown(name)} of its material")
    color = surface.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
    return vector(color[:3]), bool(material.get("doubleSided", False))


# glTF perspective cameras: they look along -z with y up; `yfov` in radians is the full vertical angle (3.10).


NO_END = 1e5  # an infinite projection's far plane, in units of its near plane


def camera_of(camera: CameraEntry, to_world: np.ndarray, size: Size, drop: Callable[[str], None]) -> Camera | None:
    """Return a perspective camera in world space; None, after a call of `drop`, for an orthographic camera.

    Raises:
        SceneError: a value is missing, or the specification refuses it.

    """
    if camera.get("type") != "perspective":
        drop(f"a camera of type {camera.get('type')!r}")
        return None
    lens = camera.get("perspective", {})
    try:
        yfov, near = float(lens["yfov"]), float(lens["znear"])
        far = float(lens.get("zfar", NO_END * near))
        aspect = float(lens.get("aspectRatio", SIZE[0] / SIZE[1]))
    except (KeyError, TypeError, ValueError) as error:
        raise SceneError(f"a perspective camera needs the numbers yfov and znear: {error}") from None
    if "zfar" not in lens:
        drop(f"the camera's view without end; it ends at {far:g} m")
    height = SIZE[1]
    linear = to_world[:3, :3]
    if np.linalg.det(linear) < 0:
        drop("the mirror in a camera's matrix; the image is not mirrored")
    width, height = size or (max(1, round(height * aspect)), height)
    eye, forward = to_world[:3, 3], -linear[:, 2] / np.linalg.norm(linear[:, 2])
    return Camera(
        eye=vector(eye),
        target=vector(eye + forward),
        up=vector(linear[:, 1]),
        fovy=degrees(yfov),
        width=width,
        height=height,
        near=near,
        far=far,
    )
