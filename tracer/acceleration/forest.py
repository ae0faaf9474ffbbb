"""The triangles of all meshes of a scene in one tree, on the host and on the device."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import drjit as dr
import numpy as np

from cases.baking import world_triangles
from cases.scene import Mesh, Triangle
from tracer.acceleration.build import build
from tracer.acceleration.nodes import HostNodes, Nodes, quantise
from tracer.arrays import ArrayTypes
from tracer.assets import Assets, aligned, packets
from tracer.configuration import Configuration
from tracer.geometry import TriangleArrays
from tracer.rays import Interval, Ray
from tracer.triangles import degenerate, object_normals, slenderness

Meshes = tuple[tuple[int, Mesh | Triangle], ...]  # (index into the scene's shapes, mesh), ascending
RECORD = 12  # words per slot: nine coordinates, the number, and two that make it three packets of four


@dataclass(frozen=True, kw_only=True)
class HostForest:
    """Triangles of all meshes, degenerate ones left out, numbered by shape and then by face."""

    nodes: HostNodes
    records: np.ndarray  # (slots, RECORD) float32: corners in world space [m], the number's bits
    normals: np.ndarray  # (n, 3) float64, object space
    slenderness: np.ndarray  # (n,) float64
    shapes: np.ndarray  # (n,) int32
    faces: np.ndarray  # (n,) int32


def bounds(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return lower and upper corners (n, 3) of triangles (n, 3, 3)."""
    first, second, third = corners[:, 0], corners[:, 1], corners[:, 2]
    return np.minimum(np.minimum(first, second), third), np.maximum(np.maximum(first, second), third)


@lru_cache(maxsize=16)
def host_forest(meshes: Meshes) -> HostForest | None:
    """Return the tree over all meshes' triangles, or None where all are degenerate."""
    kept = [(index, mesh, np.flatnonzero(~degenerate(mesh))) for index, mesh in meshes]
    corners = np.concatenate([world_triangles(mesh)[faces] for _, mesh, faces in kept])
    if len(corners) == 0:
        return None
    tree = build(*bounds(corners))
    records = aligned((len(tree.slots), RECORD), np.float32)
    records[:, 9:] = 0
    records[:, :9] = corners.reshape(-1, 9)[tree.slots]
    records[:, 9] = tree.slots.astype(np.uint32).view(np.float32)
    return HostForest(
        nodes=quantise(tree),
        records=records,
        normals=np.concatenate([object_normals(mesh)[faces] for _, mesh, faces in kept]),
        slenderness=np.concatenate([slenderness(mesh)[faces] for _, mesh, faces in kept]),
        shapes=np.concatenate([np.full(len(faces), index) for index, _, faces in kept]).astype(np.int32),
        faces=np.concatenate([faces for _, _, faces in kept]).astype(np.int32),
    )


class Forest:
    """The tree and its triangles as Dr.Jit arrays."""

    def __init__(self, host: HostForest, types: ArrayTypes, assets: Assets) -> None:
        self.types, self.host, self._assets = types, host, assets
        self.nodes = Nodes(host.nodes, types, assets, name="forest")

    def item(self, slot: Any) -> tuple[TriangleArrays, Any]:
        """Return the triangle in a slot, and its number."""
        # As integers: Dr.Jit flushes the number's bits to zero where they are a subnormal float.
        records = self._assets.upload("forest records", self.types.UInt, lambda: self.host.records.view(np.uint32))
        words = packets(self.types, records, slot, RECORD // 4)
        Single: Any = dr.float32_array_t(self.types.Float)
        x = [self.types.Float(dr.reinterpret_array(Single, word)) for word in words[:9]]
        Vector = self.types.Vector
        triangle = TriangleArrays(first=Vector(*x[0:3]), second=Vector(*x[3:6]), third=Vector(*x[6:9]))
        return triangle, self.types.Int(words[9])

    def meet(self, configuration: Configuration, ray: Ray, item: TriangleArrays, interval: Interval) -> Any:
        """Return the t of one ray and one triangle, inf where they do not meet."""
        return configuration["triangle"](ray, item, interval)

    def shape(self, number: Any, active: Any) -> Any:
        """Return the index of the shape that a triangle belongs to."""
        if len(set(self.host.shapes[[0, -1]])) == 1:
            return self.types.Int(int(self.host.shapes[0]))
        shapes = self._assets.upload("forest shapes", self.types.Int, lambda: self.host.shapes)
        return dr.gather(self.types.Int, shapes, self.types.UInt(number), active)

    def face(self, number: Any, active: Any) -> Any:
        """Return a triangle's index in its mesh."""
        faces = self._assets.upload("forest faces", self.types.Int, lambda: self.host.faces)
        return dr.gather(self.types.Int, faces, self.types.UInt(number), active)

    def normal(self, number: Any, active: Any) -> Any:
        """Return a triangle's unit normal in object space."""
        normals = self._assets.floats("forest normals", self.types, lambda: self.host.normals)
        return dr.gather(self.types.Vector, normals, self.types.UInt(number), active)

    def slenderness(self, number: Any, active: Any) -> Any:
        """Return the product of a triangle's edges over twice its area."""
        slender = self._assets.floats("forest slenderness", self.types, lambda: self.host.slenderness)
        return dr.gather(self.types.Float, slender, self.types.UInt(number), active)
