"""glTF meshes: each primitive of triangles a mesh of its own, its material's base colour as albedo (3.7.2, 3.9)."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from rayproof.cases.scene import Mesh, Rgb
from rayproof.cases.scene_fields import shown
from rayproof.reports.interchange.gltf.accessors import array
from rayproof.reports.interchange.gltf.document import Document
from rayproof.reports.interchange.numbers import matrix, vector

TRIANGLES = 4
Drop = Callable[[str], None]


def meshes_of(document: Document, index: Any, to_world: np.ndarray, drop: Drop) -> Iterator[Mesh]:
    """Yield the primitives of a mesh, placed.

    Raises:
        SceneError: an array or a value is not what glTF or the specification allows.

    """
    mesh = document.one("meshes", index)
    for number, primitive in enumerate(mesh.get("primitives", [])):
        place = f"mesh {shown(mesh.get('name', index))}, primitive {number}"
        if primitive.get("mode", TRIANGLES) != TRIANGLES:
            drop(f"{place}: its mode {primitive['mode']} is not triangles")
            continue
        if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
            drop(f"{place}: it is compressed by Draco")
            continue
        attributes = primitive.get("attributes", {})
        if "targets" in primitive:
            drop(f"{place}: its morph targets")
        if "NORMAL" in attributes:
            drop(f"{place}: its vertex normals; it is shaded by faces")
        vertices = array(document, attributes.get("POSITION"), "VEC3")
        corners = (
            array(document, primitive["indices"], "SCALAR").ravel()
            if "indices" in primitive
            else np.arange(len(vertices))
        )
        albedo, two_sided = _material(document, primitive, place, drop)
        faces = corners[: len(corners) // 3 * 3].astype(np.int64).reshape(-1, 3)
        document.budget.spend("triangles", len(faces), by=place)
        yield Mesh(albedo=albedo, two_sided=two_sided, vertices=vertices, faces=faces, to_world=matrix(to_world))


def _material(document: Document, primitive: dict[str, Any], place: str, drop: Drop) -> tuple[Rgb, bool]:
    """Return albedo and two-sidedness; glTF's default material is white, metal and one-sided (section 3.9.6)."""
    if "material" not in primitive:
        return (1.0, 1.0, 1.0), False
    material = document.one("materials", primitive["material"])
    surface = material.get("pbrMetallicRoughness", {})
    if "baseColorTexture" in surface:
        drop(f"{place}: its base colour's texture")
    if surface.get("metallicFactor", 1.0) != 0:
        drop(f"{place}: its metal; the base colour is the albedo of a diffuse surface")
    if any(material.get("emissiveFactor", ())):
        drop(f"{place}: its emission")
    color = surface.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
    return vector(color[:3]), bool(material.get("doubleSided", False))
