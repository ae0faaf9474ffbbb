"""OBJ, PLY, STL and GLB files parsed by trimesh, in a process of its own (`cases.foreign`)."""

import io
from typing import Any

import numpy as np
import trimesh

from rayproof.cases.budget import LIMITS


def answer(kind: str, content: bytes) -> tuple[dict[str, Any], bytes]:
    """Return the numbers of vertices and faces, and both: float64 and int64, three each.

    Raises:
        ValueError: it holds none, or more triangles than are read.

    """
    # From bytes and without a resolver: nothing that the file refers to can be opened.
    world = trimesh.load_scene(
        io.BytesIO(content), file_type=kind, process=False, maintain_order=True, skip_materials=True
    )
    triangles = sum(
        len(getattr(world.geometry[world.graph[node][1]], "faces", ())) for node in world.graph.nodes_geometry
    )
    if not 0 < triangles <= LIMITS["triangles"]:
        return {"triangles": triangles}, b""
    mesh = world.to_mesh()
    vertices = np.ascontiguousarray(mesh.vertices, dtype=np.float64)
    faces = np.ascontiguousarray(mesh.faces, dtype=np.int64)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise ValueError(f"its vertices and faces are no triples, got {vertices.shape} and {faces.shape}")
    return {"triangles": len(faces), "vertices": len(vertices)}, vertices.tobytes() + faces.tobytes()
