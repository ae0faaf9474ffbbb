"""One tree for each kind of shape and one for all triangles: on the host, on the device, and their queries.

Spheres, cubes and squares have a tree for each kind, so that a leaf needs one formula; all meshes' triangles share one.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Mesh, Shape, Triangle
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arithmetic import prepared, smaller, turning_alike, turns
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.kernel.parameters import LITERALS, DeviceBuffers, KernelConstants, aligned, packets
from rayproof.tracer.plan import Context
from rayproof.tracer.rays import Interval, NearestHit, Ray, ShadowRay
from rayproof.tracer.shapes.meshes import (
    TriangleArrays,
    baked,
    degenerate,
    in_pieces,
    object_normals,
    reaches,
    slenderness,
)
from rayproof.tracer.shapes.primitives import traced
from rayproof.tracer.shapes.shape import GatheredTransform, TracedShape
from rayproof.tracer.trees.beams import Beam
from rayproof.tracer.trees.boxes import HostNodes, Nodes, on_grid, quantise
from rayproof.tracer.trees.build import in_parts, slanting, tree_over
from rayproof.tracer.trees.traversal import WIDER, Hierarchy, Walk, any_hit_in_groups, nearest

Members = tuple[tuple[int, Shape], ...]  # (index into the scene's shapes, shape), ascending


@dataclass(frozen=True, kw_only=True)
class HostShapeHierarchy:
    """Shapes of one kind, numbered by their index in the scene."""

    like: TracedShape  # any of them
    nodes: HostNodes
    records: np.ndarray  # (slots, 4 n) float64
    numbers: np.ndarray  # (slots,) int32
    identity: bool  # whether object space is world space for all of them


@lru_cache(maxsize=16)
def host_crowd(members: Members) -> HostShapeHierarchy:
    """Return the tree over shapes of one kind."""
    shapes = [traced(shape) for _, shape in members]
    boxes = np.array([shape.box for shape in shapes])
    identity = all(shape.transform.identity for shape in shapes)
    lower, upper = boxes[:, 0].T, boxes[:, 1].T
    boxes = on_grid(lower, upper)
    tree = tree_over(boxes)
    records = np.array([shape.packed(identity=identity) for shape in shapes])
    return HostShapeHierarchy(
        like=shapes[0],
        nodes=quantise(tree, boxes),
        records=records[tree.slots],
        numbers=np.array([index for index, _ in members], dtype=np.int32)[tree.slots],
        identity=identity,
    )


class ShapeHierarchy:
    """The tree and its shapes as Dr.Jit arrays."""

    def __init__(
        self,
        host: HostShapeHierarchy,
        types: ArrayTypes,
        buffers: DeviceBuffers,
        *,
        name: str,
        parameters: KernelConstants,
    ) -> None:
        self.host, self.types, self._assets, self._name = host, types, buffers, name
        self.nodes = Nodes(host.nodes, types, buffers, name=name, parameters=parameters)

    def item(self, slot: Any) -> tuple[Any, Any]:
        """Return (placement or None, shape argument of the formula) of a slot, and the shape's index in the scene."""
        host, Vector = self.host, self.types.Vector
        records = self._assets.floats(f"{self._name} records", self.types, lambda: host.records)
        numbers = self._assets.upload(f"{self._name} numbers", self.types.Int, lambda: host.numbers)
        x = packets(self.types, records, slot, host.records.shape[1] // 4)
        transform = None
        if not host.identity:
            rows = [Vector(*x[3 * row : 3 * row + 3]) for row in range(3)]
            transform, x = GatheredTransform(rows=rows, translation=Vector(*x[9:12])), x[12:]
        number = dr.gather(self.types.Int, numbers, slot)
        return (transform, host.like.unpacked(x, self.types)), number

    def meet(self, configuration: Configuration, ray: Ray, item: Any, interval: Interval) -> Any:
        """Return the t at which a ray hits a shape, or inf."""
        transform, arrays = item
        formula = configuration.formula(self.host.like.slot)
        if transform is not None and formula.facts.get("space") == "object":
            ray = configuration["to_object"](ray, transform)
        return formula.function(ray, arrays, interval)

    def shape(self, number: Any, active: Any) -> Any:
        """Return the index of the shape."""
        return number

    def face(self, number: Any, active: Any) -> Any:
        """Return the face: these shapes have one."""
        return self.types.Int(0)


Meshes = tuple[tuple[int, Mesh | Triangle], ...]  # (index into the scene's shapes, mesh), ascending
RECORD = 12  # words per slot: nine coordinates, the number, and two that make it three packets of four


@dataclass(frozen=True, kw_only=True)
class Member:
    """A mesh in the tree, without its degenerate triangles."""

    index: int  # into the scene's shapes
    mesh: Mesh | Triangle
    faces: np.ndarray | slice  # the remaining faces; a slice if all remain


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
    """Return a function's value for each triangle, (n, ...); cached, since every render of a scene reads it."""
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
    """Return the tree over all meshes' triangles, or None if all are degenerate; meshes are equal by content.

    With `parts`, long oblique triangles are split into parts.
    """
    members = tuple(_member(*mesh) for mesh in meshes)
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
        """Return the t at which a ray hits a triangle, or inf."""
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
        return dr.gather(self.types.Vector, self._of_each(object_normals), self.types.UInt(number), active)

    def slenderness(self, number: Any, active: Any) -> Any:
        """Return the product of a triangle's edges over twice its area."""
        return dr.gather(self.types.Float, self._of_each(slenderness), self.types.UInt(number), active)

    def reach(self, number: Any, active: Any) -> Any:
        """Return the distance [m] of a triangle's farthest corner from the world's origin."""
        return dr.gather(self.types.Float, self._of_each(reaches), self.types.UInt(number), active)

    def _of_each(self, of: Callable[[Shape, Any], np.ndarray]) -> Any:
        name = f"forest {of.__name__}"
        return self._assets.floats(name, self.types, lambda: _table(self.host, of, self.types.precision))


class Hierarchies:
    """The trees of a scene, in one precision."""

    def __init__(self, context: Context) -> None:
        self.scene, self.configuration, self.types = context.scene, context.configuration, context.types
        self.plan, self.buffers, self.parameters = context.plan, context.buffers, context.parameters
        self._members = self.plan.trees_of(self.scene.shapes)

    @cached_property
    def forest(self) -> TriangleHierarchy | None:
        """Return the tree over all triangles, or None without any."""
        members: Any = self._members.get("triangle", ())
        host = host_forest(tuple(members), parts=self.plan.parts) if members else None
        return None if host is None else TriangleHierarchy(host, self.types, self.buffers, self.parameters)

    @cached_property
    def hierarchies(self) -> tuple[Hierarchy, ...]:
        """Return all trees; trees of triangles come last."""
        crowds = [
            ShapeHierarchy(host_crowd(tuple(members)), self.types, self.buffers, name=name, parameters=self.parameters)
            for name, members in self._members.items()
            if name != "triangle"
        ]
        return (*crowds, *([] if self.forest is None else [self.forest]))

    def _meet(
        self, hierarchy: Hierarchy, rays: Sequence[Ray], intervals: Sequence[Interval]
    ) -> Callable[[Any, int], Any]:
        return lambda item, k: hierarchy.meet(self.configuration, rays[k], item, intervals[k])

    def _pipelined(self, hierarchy: Hierarchy) -> bool:
        return self.plan.pipelined and hierarchy is self.forest

    def nearest(
        self, rays: Sequence[Ray], intervals: Sequence[Interval], hits: list[NearestHit], *, narrow: bool
    ) -> list[NearestHit]:
        """Return the nearer of the hits in trees and the given `hits` of rays from one point."""
        for hierarchy in self.hierarchies:
            limits = [smaller(hit.distance, interval.farthest) for hit, interval in zip(hits, intervals, strict=True)]
            tree_hits = self.met(hierarchy, rays, intervals, limits=limits, narrow=narrow)
            self.parameters.store(tree_hits)
            hits = [self.nearer(hierarchy, before, *hit) for before, hit in zip(hits, tree_hits, strict=True)]
        return hits

    def met(
        self,
        hierarchy: Hierarchy,
        rays: Sequence[Ray],
        intervals: Sequence[Interval],
        *,
        limits: Sequence[Any] | None = None,
        narrow: bool = False,
    ) -> list[tuple[Any, Any]]:
        """Return t [m] and number of the first item in a tree that each of the rays from a point hits.

        Hits beyond `limits` may be missed.
        """
        limits = [interval.farthest for interval in intervals] if limits is None else limits
        self.parameters.store(limits)
        width = max(dr.width(ray.direction) for ray in rays)
        rays = prepared(rays, together=narrow)
        beam = Beam(hierarchy.nodes, rays[0].origin, [ray.direction for ray in rays])
        meet = self._meet(hierarchy, rays, intervals)
        walk = Walk(hierarchy=hierarchy, beam=beam, meet=meet, pipelined=self._pipelined(hierarchy))
        return nearest(walk, closer=self.configuration["nearest"], limits=limits, width=width)

    def nearer(self, hierarchy: Hierarchy, before: NearestHit, distance: Any, number: Any) -> NearestHit:
        """Return the nearer of the hit before and a hit in a tree."""
        is_hit = distance < dr.inf
        index = hierarchy.shape(number, is_hit)
        closer = self.configuration["nearest"]
        take = closer(distance, before.distance) | (is_hit & (distance == before.distance) & (index < before.shape))
        return NearestHit(
            distance=dr.select(take, distance, before.distance),
            shape=dr.select(take, index, before.shape),
            face=dr.select(take, hierarchy.face(number, is_hit), before.face),
            number=number if hierarchy is self.forest else before.number,
        )

    def blocked(self, shadow_rays: Sequence[ShadowRay], light: Any, blocked: list[Any]) -> list[Any]:
        """Return the masks of shadow rays that are `blocked` already or by a shape in a tree.

        All of them end at `light` [m] and traverse a tree as one beam from there. The formulas get the shadow rays
        unchanged, so that a strategy against acne has the same effect as without a tree.
        """
        obstructed = self.configuration["obstructed"]
        rays, intervals = (
            [shadow_ray.ray for shadow_ray in shadow_rays],
            [shadow_ray.interval for shadow_ray in shadow_rays],
        )
        camera = self.scene.camera
        eye = self.parameters("camera eye", self.types.Vector(*camera.eye))
        sample = self.parameters("camera sample", self.types.Float(2 * math.tan(camera.alpha) / camera.height))
        if self.hierarchies:
            self.parameters.store(light)
            rays = prepared(rays)
        for hierarchy in self.hierarchies:
            active = [shadow_ray.active & ~there for there, shadow_ray in zip(blocked, shadow_rays, strict=True)]
            triangles = hierarchy is self.forest

            def walk(
                group: Sequence[Any], turn: Any, hierarchy: Hierarchy = hierarchy, triangles: bool = triangles
            ) -> Any:
                beam, farthest = self._feeling(hierarchy, rays, light, group)
                alike = turning_alike(rays, turn) if triangles else rays
                meet = self._meet(hierarchy, alike, intervals)
                return Walk(hierarchy=hierarchy, beam=beam, meet=meet, pipelined=self._pipelined(hierarchy)), farthest

            blockers = any_hit_in_groups(
                hierarchy.types,
                walk,
                points=[ray.origin for ray in rays],
                alike=turns(rays) if triangles else [()] * len(rays),
                columns=self.plan.columns,
                eye=eye,
                sample=sample,
                skips=None if shadow_rays[0].skip is None else self._skips(hierarchy, shadow_rays),
                active=active,
                width=max(dr.width(ray.origin) for ray in rays),
            )
            blocked = [there | obstructed(distance) for there, distance in zip(blocked, blockers, strict=True)]
        return blocked

    def _feeling(
        self, hierarchy: Hierarchy, rays: Sequence[Ray], light: Any, active: Sequence[Any]
    ) -> tuple[Beam, Any]:
        """Return a beam that bounds the shadow rays during their traversal of a tree, and the t of its end."""
        Single: Any = dr.float32_array_t(self.types.Float)
        if self.configuration.formula("segment").facts.get("bounded", False):
            reaches = [ray.origin - light for ray in rays]
            return Beam(hierarchy.nodes, light, reaches, active=active), Single(WIDER)
        # A shadow ray that does not end at the light is traced by itself.
        (ray,) = rays
        return Beam(hierarchy.nodes, ray.origin, [ray.direction]), Single(dr.inf)

    def _skips(self, hierarchy: Hierarchy, shadow_rays: Sequence[ShadowRay]) -> Callable[[Any, int], Any]:
        return lambda number, k: hierarchy.shape(number, self.types.Bool(True)) == shadow_rays[k].skip
