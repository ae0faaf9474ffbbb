"""A glTF scene's nodes with their matrices to the world (section 3.5)."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from rayproof.cases.scene import SceneError, shown
from rayproof.reports.interchange.gltf.document import Document
from rayproof.reports.interchange.gltf.entries import NodeEntry, SceneEntry


def placed_nodes(document: Document) -> Iterator[tuple[NodeEntry, np.ndarray]]:
    """Yield each node of the default scene with its matrix to the world, float64 (4, 4).

    Raises:
        SceneError: a node has two parents or is its own ancestor, or its numbers are no transform.

    """
    scenes = document.listed(SceneEntry)
    if not scenes:
        raise SceneError("it has no scene")
    roots = document.one(SceneEntry, document.json.get("scene", 0)).get("nodes", [])
    waiting = [(index, np.eye(4)) for index in reversed(roots)]
    seen: set[int] = set()
    while waiting:
        index, outer = waiting.pop()
        node = document.one(NodeEntry, index)
        if index in seen:
            raise SceneError(f"node {index} has two parents, or is its own ancestor")
        seen.add(index)
        document.budget.spend("elements", 1, by=f"node {index}")
        to_world = outer @ _local(node, index)
        yield node, to_world
        waiting += [(child, to_world) for child in reversed(node.get("children", []))]


def _local(node: NodeEntry, index: int) -> np.ndarray:
    """Return a node's matrix: given by columns, or translation times rotation times scale (section 3.5.3)."""
    if "matrix" in node:
        return _numbers(node["matrix"], 16, index).reshape(4, 4).T
    matrix = np.eye(4)
    turn = _numbers(node.get("rotation", (0, 0, 0, 1)), 4, index)
    if not np.linalg.norm(turn) > 0:
        raise SceneError(f"node {index}: the rotation must not be zero")
    rotation = Rotation.from_quat(turn).as_matrix()  # x, y, z, w, of whatever length
    matrix[:3, :3] = rotation * _numbers(node.get("scale", (1, 1, 1)), 3, index)
    matrix[:3, 3] = _numbers(node.get("translation", (0, 0, 0)), 3, index)
    return matrix


def _numbers(values: Any, count: int, index: int) -> np.ndarray:
    try:
        found = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (count,):
        raise SceneError(f"node {index}: {count} numbers are needed, got {shown(values)}")
    return found
