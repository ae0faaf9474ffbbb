"""The triangles of all meshes of a scene in one tree, on the host and on the device."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Mesh, Shape, Triangle
from rayproof.tracer.acceleration.builder import tree_over
from rayproof.tracer.acceleration.grid_boxes import on_grid
from rayproof.tracer.acceleration.parts import in_parts, slanting
from rayproof.tracer.acceleration.quantised_boxes import HostNodes, Nodes, quantise
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.kernel.parameters import LITERALS, DeviceBuffers, KernelConstants, aligned, packets
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.shapes.triangles import TriangleArrays, baked, degenerate, in_pieces, object_normals, slenderness

Meshes = tuple[tuple[int, Mesh | Triangle], ...]  # (index into the scene's shapes, mesh), ascending
RECORD = 12  # words per slot: nine coordinates, the number, and two that make it three packets of four


@dataclass(frozen=True, kw_only=True)
class Member:
    """A mesh in the tree, without its degenerate triangles."""

    index: int  # into the scene's shapes
    mesh: Mesh | Triangle
    faces: np.ndarray | slice  # those that are left; a slice where all are


@dataclass(frozen=True, kw_only=True, eq=False)
class HostTriangleHierarchy:
    """Triangles of all meshes, degenerate ones left out, numbered by shape and then by face."""

    nodes: HostNodes
    records: np.ndarray  # (slots, RECORD) uint32: the bits of the corners in world space [m], float32, and the number
    members: tuple[Member, ...]
    counts: tuple[int, ...]  # triangles of each

    @cached_property
    def faces(self) -> np.ndarray:
        """Return each triangle's index in its mesh, (n,) int32."""
        return np.concatenate(
            [
                np.arange(count, dtype=np.int32) if isinstance(member.faces, slice) else member.faces.astype(np.int32)
                for member, count in zip(self.members, self.counts, strict=True)
            ]
        )

    @property
    def whole(self) -> bool:
        """Return whether a triangle's number is its face index: one mesh, and nothing left out."""
        return len(self.members) == 1 and isinstance(self.members[0].faces, slice)

    @cached_property
    def shapes(self) -> np.ndarray:
        """Return the index of each triangle's shape, (n,) int32."""
        return np.repeat(np.array([member.index for member in self.members], dtype=np.int32), self.counts)


@lru_cache(maxsize=16)
def _table(host: HostTriangleHierarchy, of: Callable[[Shape, Any], np.ndarray], kind: Any) -> np.ndarray:
    """Return what a function says of each triangle, (n, ...); kept, since every rendering of a scene looks it up."""
    parts = [of(member.mesh, kind)[member.faces] for member in host.members]
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def bounds(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return lower and upper corners (3, n) of triangles, rows of nine numbers."""
    lower, upper = (np.empty((3, len(corners)), dtype=corners.dtype) for _ in range(2))

    def work(piece: slice) -> None:
        first, second, third = np.ascontiguousarray(corners[piece].T).reshape(3, 3, -1)
        np.minimum(np.minimum(first, second), third, out=lower[:, piece])
        np.maximum(np.maximum(first, second), third, out=upper[:, piece])

    in_pieces(len(corners), work)
    return lower, upper


def _member(index: int, mesh: Mesh | Triangle) -> Member:
    without = degenerate(mesh)
    return Member(index=index, mesh=mesh, faces=np.flatnonzero(~without) if without.any() else slice(None))


@lru_cache(maxsize=16)
def host_forest(meshes: Meshes, *, parts: bool = True) -> HostTriangleHierarchy | None:
    """Return the tree over all meshes' triangles, or None where all are degenerate; meshes are equal by content.

    With `parts` a tree of long slanting triangles holds them in parts.
    """
    members = tuple(_member(*one) for one in meshes)
    every = [baked(member.mesh)[member.faces] for member in members]
    corners = every[0] if len(every) == 1 else np.concatenate(every)
    if len(corners) == 0:
        return None
    lower, upper, owner = *bounds(corners), None
    if parts and slanting(corners):
        lower, upper, owner = in_parts(corners, lower, upper)
    boxes = on_grid(lower, upper)
    tree = tree_over(boxes)
    nodes = quantise(tree, boxes)
    del lower, upper
    owners = tree.slots if owner is None else owner[tree.slots]
    records = aligned((len(owners), RECORD), np.uint32)

    def write(piece: slice) -> None:
        slots = owners[piece]
        records[piece, :9] = corners.take(slots, axis=0).view(np.uint32)
        records[piece, 9] = slots
        records[piece, 10:] = 0

    in_pieces(len(records), write)
    return HostTriangleHierarchy(nodes=nodes, records=records, members=members, counts=tuple(map(len, every)))


class TriangleHierarchy:
    """The tree and its triangles as Dr.Jit arrays."""

    def __init__(
        self,
        host: HostTriangleHierarchy,
        types: ArrayTypes,
        buffers: DeviceBuffers,
        parameters: KernelConstants = LITERALS,
    ) -> None:
        self.types, self.host, self._assets, self._parameters = types, host, buffers, parameters
        self.nodes = Nodes(host.nodes, types, buffers, name="forest", parameters=parameters)

    @property
    def _kind(self) -> Any:
        return np.float64 if self.types.precision == "float64" else np.float32

    def item(self, slot: Any) -> tuple[TriangleArrays, Any]:
        """Return the triangle in a slot, and its number."""
        # As integers: Dr.Jit flushes the number's bits to zero where they are a subnormal float.
        records = self._assets.upload("forest records", self.types.UInt, lambda: self.host.records)
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
        if len(self.host.members) == 1:
            return self._parameters("forest shape", self.types.Int(self.host.members[0].index))
        shapes = self._assets.upload("forest shapes", self.types.Int, lambda: self.host.shapes)
        return dr.gather(self.types.Int, shapes, self.types.UInt(number), active)

    def face(self, number: Any, active: Any) -> Any:
        """Return a triangle's index in its mesh."""
        if self.host.whole:
            return self.types.Int(number)
        faces = self._assets.upload("forest faces", self.types.Int, lambda: self.host.faces)
        return dr.gather(self.types.Int, faces, self.types.UInt(number), active)

    def normal(self, number: Any, active: Any) -> Any:
        """Return a triangle's unit normal in object space."""
        normals = self._assets.floats(
            "forest normals", self.types, lambda: _table(self.host, object_normals, self._kind)
        )
        return dr.gather(self.types.Vector, normals, self.types.UInt(number), active)

    def slenderness(self, number: Any, active: Any) -> Any:
        """Return the product of a triangle's edges over twice its area."""
        slender = self._assets.floats(
            "forest slenderness", self.types, lambda: _table(self.host, slenderness, self._kind)
        )
        return dr.gather(self.types.Float, slender, self.types.UInt(number), active)
