"""The triangles of glTF meshes: of one primitive, and of all placed meshes of a GLB file.

Source: Khronos, glTF 2.0 specification (2021), sections 3.7.2.1 and 4.4.
"""

from pathlib import Path

import numpy as np

from rayproof.cases.foreign_files import Budget
from rayproof.cases.gltf_document import (
    BufferEntry,
    Document,
    MeshEntry,
    PrimitiveEntry,
    array,
    glb_document,
    placed_nodes,
)
from rayproof.cases.polygon_files import LARGEST
from rayproof.cases.scene import SceneError, shown

TRIANGLES, STRIP, FAN = 4, 5, 6
DRACO = "KHR_draco_mesh_compression"


def primitive_mesh(document: Document, primitive: PrimitiveEntry, *, by: str) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the vertices (n, 3) and triangles (m, 3) int64 of a primitive, and the number of its indices.

    The triangles are counted for `by` before they are built.

    Raises:
        SceneError: an array violates the glTF specification, or there are too many triangles.

    """
    mode = primitive.get("mode", TRIANGLES)
    vertices = array(document, primitive.get("attributes", {}).get("POSITION"), "VEC3")
    indexed = "indices" in primitive
    corners = array(document, primitive["indices"], "SCALAR").ravel() if indexed else np.arange(len(vertices))
    count = len(corners) // 3 if mode == TRIANGLES else max(0, len(corners) - 2)
    document.budget.spend("triangles", count, by=by)
    whole = corners[: 3 * count] if mode == TRIANGLES else corners
    return vertices, _faces(whole.astype(np.int64), mode) if count else np.empty((0, 3), np.int64), len(corners)


def _faces(corners: np.ndarray, mode: int) -> np.ndarray:
    """Return the triangles (count, 3) of a list, a strip or a fan of vertices (section 3.7.2.1)."""
    if mode == TRIANGLES:
        return corners.reshape(-1, 3)
    number = np.arange(len(corners) - 2)
    if mode == FAN:
        return corners[np.stack([number + 1, number + 2, np.zeros_like(number)], axis=1)]
    odd = number % 2  # every second triangle of a strip has the opposite winding, and is reversed
    return corners[np.stack([number, number + 1 + odd, number + 2 - odd], axis=1)]


def glb_mesh(content: bytes) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return vertices (n, 3) float64 [m] and triangles (m, 3) int64 of all placed meshes of a GLB file; no sentences.

    Raises:
        SceneError: the file violates the glTF specification, names another file, or exceeds the budget.

    """
    budget = Budget(read=len(content))
    try:
        document = glb_document(content, Path(), budget)
        if any("uri" in buffer for buffer in document.listed(BufferEntry)):
            raise SceneError("keeps data outside itself, which is never opened")
        return *_joined(document), []
    except (TypeError, AttributeError, KeyError, IndexError, ValueError, OverflowError) as error:
        if isinstance(error, SceneError):
            raise
        # Members may have any type of JSON instead of glTF's.
        raise SceneError(f"is not glTF: {' '.join(str(error).split())}") from None


def _joined(document: Document) -> tuple[np.ndarray, np.ndarray]:
    points, triangles, count = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    for node, to_world in placed_nodes(document):
        mesh = document.one(MeshEntry, node["mesh"]) if "mesh" in node else MeshEntry()
        for number, primitive in enumerate(mesh.get("primitives", [])):
            place = f"mesh {shown(mesh.get('name', '?'))}, primitive {number}"
            if primitive.get("mode", TRIANGLES) not in (TRIANGLES, STRIP, FAN):
                continue  # points and lines
            if DRACO in primitive.get("extensions", {}):
                raise SceneError(f"{place}: it is compressed by Draco ({DRACO})")
            vertices, faces, _ = primitive_mesh(document, primitive, by=place)
            if faces.size and not (faces.min() >= 0 and faces.max() < len(vertices)):
                raise SceneError(f"{place}: its indices are from 0 to {len(vertices) - 1}, got {faces.max()}")
            document.budget.expand(vertices.size * 8 + faces.nbytes, by=place)
            with np.errstate(over="ignore", invalid="ignore"):
                placed = vertices.astype(np.float64) @ to_world[:3, :3].T + to_world[:3, 3]
            if not (np.abs(placed) <= LARGEST).all():
                raise SceneError(f"{place}: a coordinate must be a finite number")
            points.append(placed)
            triangles.append(faces + count)
            count += len(vertices)
    return np.concatenate(points), np.concatenate(triangles)
