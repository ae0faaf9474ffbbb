"""Read a glTF file: its default scene, with the point lights of KHR_lights_punctual (Khronos 2018)."""

from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Final

import numpy as np

from rayproof.cases.scene import Camera, Mesh, PointLight, Scene, SceneError, shown
from rayproof.reports.interchange import IMPORTERS, Folders, Imported, Size
from rayproof.reports.interchange.framing import camera_for, light_for
from rayproof.reports.interchange.gltf.cameras import camera_of
from rayproof.reports.interchange.gltf.document import Document, read_document
from rayproof.reports.interchange.gltf.entries import AnimationEntry, CameraEntry, LightOfNode, MeshEntry, SceneEntry
from rayproof.reports.interchange.gltf.meshes import meshes_of
from rayproof.reports.interchange.gltf.nodes import placed_nodes
from rayproof.reports.interchange.numbers import vector

LIGHTS: Final = "KHR_lights_punctual"
UNDERSTOOD = (LIGHTS, "KHR_mesh_quantization")


@IMPORTERS.register(".glb")
@IMPORTERS.register(".gltf")
def import_gltf(path: Path, size: Size, allowed: Folders) -> Imported:
    """Return the default scene of a glTF file.

    Raises:
        SceneError: the file cannot be understood, or holds what the specification refuses.

    """
    dropped: dict[str, None] = {}

    def drop(sentence: str) -> None:
        dropped[f"{path.name}: {sentence}"] = None

    try:
        return Imported(scene=_scene(read_document(path), size, drop), dropped=tuple(dropped))
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None
    except (TypeError, AttributeError, KeyError, ValueError, OverflowError) as error:
        # Members of other types than glTF's: JSON may hold anything.
        raise SceneError(f"{path}: is not glTF: {' '.join(str(error).split())}") from None


def _scene(document: Document, size: Size, drop: Callable[[str], None]) -> Scene:
    required = document.json.get("extensionsRequired", [])
    for name in dict.fromkeys([*required, *document.json.get("extensionsUsed", [])]):
        if name not in UNDERSTOOD:
            drop(f"the extension {shown(name)}{', which it requires' if name in required else ''}")
    meshes: list[Mesh] = []
    cameras: list[Camera] = []
    lights: list[PointLight] = []
    nodes = list(placed_nodes(document))
    # Before any is built: a mesh may be named by every node.
    named = [document.one(MeshEntry, node["mesh"]) for node, _ in nodes if "mesh" in node]
    document.budget.spend("shapes", sum(len(mesh.get("primitives", [])) for mesh in named), by="it with all its nodes")
    for node, to_world in nodes:
        if "skin" in node:
            drop(f"the skin of node {shown(node.get('name', '?'))}; the mesh keeps its pose")
        if "mesh" in node:
            meshes += meshes_of(document, node["mesh"], to_world, drop)
        if "camera" in node:
            found = camera_of(document.one(CameraEntry, node["camera"]), to_world, size, drop)
            cameras += [found] if found else []
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
    camera = cameras[0] if cameras else camera_for(tuple(meshes), size, up=(0.0, 1.0, 0.0))
    if not lights:
        drop("it has no point light; one was made")
        lights = [light_for(camera)]
    return Scene(camera=camera, shapes=tuple(meshes), lights=tuple(lights))


def _light(
    document: Document, reference: LightOfNode, to_world: np.ndarray, drop: Callable[[str], None]
) -> list[PointLight]:
    """Return a point light: `intensity` is in candela, taken as W/sr, so the flux is 4 pi times it."""
    known = document.json.get("extensions", {}).get(LIGHTS, {}).get("lights", [])
    index = reference.get("light")
    if not isinstance(index, int) or not 0 <= index < len(known):
        raise SceneError(f"{LIGHTS} has {len(known)} lights, none at {shown(index)}")
    light = known[index]
    if light.get("type") != "point":
        drop(f"the {light.get('type')} light {shown(light.get('name', index))}")
        return []
    if "range" in light:
        drop(f"the range of the light {shown(light.get('name', index))}; it reaches as far as light does")
    intensity = float(light.get("intensity", 1.0)) * np.asarray(light.get("color", (1.0, 1.0, 1.0)), dtype=np.float64)
    return [PointLight(position=vector(to_world[:3, 3]), flux=vector(4 * pi * intensity))]
