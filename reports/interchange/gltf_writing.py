"""Export of a scene as glTF 2.0 (Khronos 2021): meshes in a buffer of the file itself, one camera, point lights.

A point light's intensity in candela is its flux over 4 pi (KHR_lights_punctual, Khronos 2018). A surface without metal,
fully rough and without specular reflection (KHR_materials_specular) is Lambert's: glTF 2.0, appendix B. A node's matrix
must be a translation, a rotation and a scale (section 3.5.3), so that the vertices of a sheared mesh are written in
world space. All surfaces are double-sided: programs cull the backs of others, which here block light.
"""

import base64
import json
from math import pi, radians
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.placement import frame, world_triangles
from rayproof.cases.scene import IDENTITY, Camera, Matrix, Mesh, Scene, SceneError, Shape
from rayproof.reports.interchange import EXPORTERS, SceneFormat
from rayproof.reports.interchange.gltf_scene import LIGHTS
from rayproof.reports.results.files import write_text

SPECULAR = "KHR_materials_specular"
FLOAT, UNSIGNED = 5126, 5125  # component types
VERTICES, INDICES = 34962, 34963  # targets of buffer views
SHEARED = 1e-12  # cosine between the columns of a matrix, in rounding
SAYS = SceneFormat(
    title="glTF 2.0",
    shapes=("mesh",),
    shading=("inverse_square",),
    clip=("depth",),
    two_sided="always",
    greatest_albedo=1.0,
    world_normals=True,
    cannot_say={
        "spheres and planes": "meshes; the case is judged as that scene",
        "cubes, squares and triangles": "meshes that equal them",
        "clip `shell` and `none`": "clip `depth`, if the planes touch nothing; else `unsupported`",
        "one-sided surfaces whose backs block light": "two-sided ones, if no back is seen; else `unsupported`",
        "simplified light": "`inverse_square`",
        "an albedo above 1": "`unsupported`",
        "a matrix that shears": "vertices in world space",
        "the size of the image": "`{width}` and `{height}`",
    },
)


@EXPORTERS.register(".gltf", says=SAYS)
def export_gltf(scene: Scene, path: Path) -> tuple[str, ...]:
    """Write `scene`, whose shapes are meshes, to `path`; return sentences about features that glTF lacks.

    Raises:
        SceneError: a shape is no mesh.
        OSError: the file cannot be written.

    """
    dropped: list[str] = []
    document = _Document()
    for index, shape in enumerate(scene.shapes):
        document.add_mesh(shape, index)
        if not shape.two_sided:
            dropped.append(f"shape {index}: that only one side of it is seen and lit")
        if max(shape.albedo) > 1:
            dropped.append(f"shape {index}: an albedo above 1, {shape.albedo}, which is cut to 1")
    document.add_camera(scene.camera)
    for light in scene.lights:
        document.add_light(light.position, light.flux)
    if scene.shading != "inverse_square":
        dropped.append("the simplified shading: glTF's light falls off with the square of the distance")
    if scene.clip != "depth":
        dropped.append(f"clip {scene.clip}: glTF clips between two planes")
    dropped.append(f"the size of the image, {scene.camera.width} x {scene.camera.height} px")
    write_text(path, json.dumps(document.finished(), indent=1) + "\n")
    return tuple(dropped)


class _Document:
    """A glTF document that grows object by object."""

    def __init__(self) -> None:
        self._lists: dict[str, list[Any]] = {"nodes": []}
        self._lights: list[dict[str, Any]] = []
        self._bytes = b""

    def finished(self) -> dict[str, Any]:
        uri = f"data:application/octet-stream;base64,{base64.b64encode(self._bytes).decode()}"
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "rayproof"},
            "scene": 0,
            "scenes": [{"nodes": [*range(len(self._lists["nodes"]))]}],
            **self._lists,
        }
        if self._bytes:
            document["buffers"] = [{"byteLength": len(self._bytes), "uri": uri}]
        used = [SPECULAR] * ("materials" in self._lists) + [LIGHTS] * bool(self._lights)
        if used:
            document["extensionsUsed"] = used
        if self._lights:
            document["extensions"] = {LIGHTS: {"lights": self._lights}}
        return document

    def _add(self, name: str, entry: dict[str, Any]) -> int:
        self._lists.setdefault(name, []).append(entry)
        return len(self._lists[name]) - 1

    def add_mesh(self, shape: Shape, index: int) -> None:
        if not isinstance(shape, Mesh):
            raise SceneError(f"glTF has no word for a {type(shape).__name__}")
        vertices, faces, placed = shape.vertices, shape.faces, shape.to_world
        if _shears(placed):
            corners = world_triangles(shape)
            vertices, placed = corners.reshape(-1, 3), IDENTITY
            faces = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
        surface = {
            "baseColorFactor": [*(min(channel, 1.0) for channel in shape.albedo), 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 1.0,
        }
        material = self._add(
            "materials",
            {
                "pbrMetallicRoughness": surface,
                "extensions": {SPECULAR: {"specularFactor": 0.0}},
                "doubleSided": True,
            },
        )
        low, high = (bound.astype(np.float64).tolist() for bound in (vertices.min(axis=0), vertices.max(axis=0)))
        primitive = {
            "attributes": {"POSITION": self._accessor(vertices, "<f4", "VEC3", min=low, max=high)},
            "indices": self._accessor(faces.reshape(-1), "<u4", "SCALAR"),
            "material": material,
        }
        mesh = self._add("meshes", {"name": f"shape-{index}", "primitives": [primitive]})
        self._node({"name": f"shape-{index}", "mesh": mesh}, placed)

    def _accessor(self, values: np.ndarray, kind: str, shape: str, **bounds: Any) -> int:
        content = values.astype(kind).tobytes()
        view = self._add(
            "bufferViews",
            {
                "buffer": 0,
                "byteOffset": len(self._bytes),
                "byteLength": len(content),
                "target": VERTICES if shape == "VEC3" else INDICES,
            },
        )
        self._bytes += content
        about = {"componentType": FLOAT if kind == "<f4" else UNSIGNED, "count": len(values), "type": shape}
        return self._add("accessors", {"bufferView": view, **about, **bounds})

    def _node(self, node: dict[str, Any], placed: Any) -> None:
        if placed != IDENTITY:
            node["matrix"] = np.asarray(placed, dtype=np.float64).T.ravel().tolist()
        self._add("nodes", node)

    def add_camera(self, camera: Camera) -> None:
        lens = {
            "aspectRatio": camera.aspect,
            "yfov": radians(camera.fovy),
            "znear": camera.near,
            "zfar": camera.far,
        }
        right, up, forward = frame(camera.eye, camera.target, camera.up)
        placed = np.eye(4)
        placed[:3] = np.column_stack([right, up, -forward, camera.eye])
        index = self._add("cameras", {"type": "perspective", "perspective": lens})
        self._node({"name": "camera", "camera": index}, placed.tolist())

    def add_light(self, position: tuple[float, float, float], flux: tuple[float, float, float]) -> None:
        brightest = max(flux)
        light = {
            "type": "point",
            "intensity": brightest / (4 * pi),
            "color": [channel / brightest for channel in flux] if brightest else [1.0, 1.0, 1.0],
        }
        self._lights.append(light)
        number = len(self._lights) - 1
        node = {"name": f"light-{number}", "translation": [*map(float, position)]}
        self._add("nodes", {**node, "extensions": {LIGHTS: {"light": number}}})


def _shears(placed: Matrix) -> bool:
    """Return whether a matrix is no product of a translation, a rotation and a scale along the axes."""
    columns = np.asarray(placed, dtype=np.float64)[:3, :3]
    unit = columns / np.linalg.norm(columns, axis=0)
    return bool(np.abs(unit.T @ unit - np.eye(3)).max() > SHEARED)
