"""All meshes of a scene in one tree, on the host and on the device."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import drjit as dr
import numpy as np

from cases.baking import world_triangles
from cases.scene import Mesh
from tracer.acceleration.build import Tree, build
from tracer.arrays import ArrayTypes
from tracer.geometry import TriangleArrays
from tracer.triangles import degenerate, object_normals, slenderness

Meshes = tuple[tuple[int, Mesh], ...]  # (index into the scene's shapes, mesh), ascending


@dataclass(frozen=True, kw_only=True)
class HostForest:
    """Triangles of all meshes, degenerate ones left out, numbered by shape and then by face."""

    tree: Tree
    corners: np.ndarray  # (n, 3, 3) float32, world [m]
    normals: np.ndarray  # (n, 3) float64, object space
    slenderness: np.ndarray  # (n,) float64
    shapes: np.ndarray  # (n,) int32
    faces: np.ndarray  # (n,) int32


@lru_cache(maxsize=16)
def host_forest(meshes: Meshes) -> HostForest | None:
    """Return the tree over all meshes' triangles, or None where all are degenerate."""
    kept = [(index, mesh, np.flatnonzero(~degenerate(mesh))) for index, mesh in meshes]
    corners = np.concatenate([world_triangles(mesh)[faces] for _, mesh, faces in kept])
    if len(corners) == 0:
        return None
    return HostForest(
        tree=build(corners),
        corners=corners,
        normals=np.concatenate([object_normals(mesh)[faces] for _, mesh, faces in kept]),
        slenderness=np.concatenate([slenderness(mesh)[faces] for _, mesh, faces in kept]),
        shapes=np.concatenate([np.full(len(faces), index) for index, _, faces in kept]).astype(np.int32),
        faces=np.concatenate([faces for _, _, faces in kept]).astype(np.int32),
    )


class Forest:
    """The tree and its triangles as Dr.Jit arrays."""

    def __init__(self, host: HostForest, types: ArrayTypes) -> None:
        self.types = types
        self.leaves = host.tree.leaves
        self._boxes = self._upload(host.tree.boxes)
        self._corners = self._upload(host.corners[host.tree.slots])
        self._numbers = types.UInt(host.tree.slots.astype(np.uint32))
        self._normals = self._upload(host.normals)
        self._slenderness = self._upload(host.slenderness)
        self._shapes = types.Int(host.shapes)
        self._faces = types.Int(host.faces)

    def _upload(self, values: np.ndarray) -> Any:
        precision = np.float64 if self.types.precision == "float64" else np.float32
        return self.types.Float(np.ascontiguousarray(values, dtype=precision).reshape(-1))

    def _vector(self, source: Any, first: Any, active: Any) -> Any:
        return self.types.Vector(*(dr.gather(self.types.Float, source, first + k, active) for k in range(3)))

    def box(self, node: Any, active: Any) -> tuple[Any, Any]:
        """Return the lower and upper corners [m] of a node's box."""
        return self._vector(self._boxes, node * 6, active), self._vector(self._boxes, node * 6 + 3, active)

    def triangle(self, slot: Any, active: Any) -> TriangleArrays:
        """Return the triangle in a slot."""
        first, second, third = (self._vector(self._corners, slot * 9 + 3 * k, active) for k in range(3))
        return TriangleArrays(first=first, second=second, third=third)

    def number(self, slot: Any, active: Any) -> Any:
        """Return the number of the triangle in a slot."""
        return dr.gather(self.types.UInt, self._numbers, slot, active)

    def shape(self, number: Any, active: Any) -> Any:
        """Return the index of the shape that a triangle belongs to."""
        return dr.gather(self.types.Int, self._shapes, number, active)

    def face(self, number: Any, active: Any) -> Any:
        """Return a triangle's index in its mesh."""
        return dr.gather(self.types.Int, self._faces, number, active)

    def normal(self, number: Any, active: Any) -> Any:
        """Return a triangle's unit normal in object space."""
        return self._vector(self._normals, number * 3, active)

    def slenderness(self, number: Any, active: Any) -> Any:
        """Return the product of a triangle's edges over twice its area."""
        return dr.gather(self.types.Float, self._slenderness, number, active)
