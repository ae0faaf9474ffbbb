"""glTF meshes: each primitive of triangles a mesh of its own, its material's base colour as albedo (3.7.2, 3.9)."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from rayproof.cases.scene import Mesh, Rgb, shown
from rayproof.reports.interchange.gltf.accessors import array
from rayproof.reports.interchange.gltf.document import Document
from rayproof.reports.interchange.gltf.entries import MaterialEntry, MeshEntry, PrimitiveEntry
from rayproof.reports.interchange.numbers import matrix, vector

TRIANGLES, STRIP, FAN = 4, 5, 6
MODES = ("points", "lines", "a line loop", "a line strip", "triangles", "a triangle strip", "a triangle fan")
DRACO = "KHR_draco_mesh_compression"
# What an attribute is, by how its name begins (section 3.7.2.1); one that begins otherwise is an application's own.
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
    """Yield the primitives of a mesh, placed.

    Raises:
        SceneError: an array or a value is not what glTF or the specification allows.

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
        vertices = array(document, attributes.get("POSITION"), "VEC3")
        corners = (
            array(document, primitive["indices"], "SCALAR").ravel()
            if "indices" in primitive
            else np.arange(len(vertices))
        )
        albedo, two_sided = _material(document, primitive, place, drop)
        whole = len(corners) // 3 * 3 if mode == TRIANGLES else len(corners)
        count = whole // 3 if mode == TRIANGLES else max(0, len(corners) - 2)
        document.budget.spend("triangles", count, by=place)
        if whole < len(corners):
            drop(f"{place}: its last {len(corners) - whole} vertices, which make no triangle")
        if not count:
            drop(f"{place}: it has {len(corners)} vertices, which make no triangle")
            continue
        faces = _faces(corners[:whole].astype(np.int64), mode)
        yield Mesh(albedo=albedo, two_sided=two_sided, vertices=vertices, faces=faces, to_world=matrix(to_world))


def _faces(corners: np.ndarray, mode: int) -> np.ndarray:
    """Return the triangles (count, 3) of a list, a strip or a fan of vertices (section 3.7.2.1)."""
    if mode == TRIANGLES:
        return corners.reshape(-1, 3)
    number = np.arange(len(corners) - 2)
    if mode == FAN:
        return corners[np.stack([number + 1, number + 2, np.zeros_like(number)], axis=1)]
    odd = number % 2  # every other triangle of a strip winds the other way, and is turned
    return corners[np.stack([number, number + 1 + odd, number + 2 - odd], axis=1)]


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
