"""The shapes that stand in trees: one tree for every kind, asked as one beam for all rays that a lane takes."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import drjit as dr

from rayproof.tracer.acceleration.packet_bounds import Beam, smaller
from rayproof.tracer.acceleration.packet_split import any_hit_in_groups
from rayproof.tracer.acceleration.shape_bvh import ShapeHierarchy, host_crowd
from rayproof.tracer.acceleration.traversal import WIDER, Hierarchy, Walk, nearest
from rayproof.tracer.acceleration.triangle_bvh import TriangleHierarchy, host_forest
from rayproof.tracer.kernel.arithmetic import prepared, turning_alike, turns
from rayproof.tracer.plan import Context
from rayproof.tracer.rays import Feeler, Interval, NearestHit, Ray


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
        """Return all trees, those of triangles last."""
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
        """Return what rays from one point meet before their `hits`, and where they meet nothing these."""
        for hierarchy in self.hierarchies:
            limits = [smaller(hit.distance, interval.farthest) for hit, interval in zip(hits, intervals, strict=True)]
            met = self.met(hierarchy, rays, intervals, limits=limits, narrow=narrow)
            self.parameters.store(met)
            hits = [self.nearer(hierarchy, before, *hit) for before, hit in zip(hits, met, strict=True)]
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
        """Return t [m] and number of what rays from one point meet first in a tree, within `limits` at least."""
        limits = [interval.farthest for interval in intervals] if limits is None else limits
        self.parameters.store(limits)
        width = max(dr.width(ray.direction) for ray in rays)
        rays = prepared(rays, together=narrow)
        beam = Beam(hierarchy.nodes, rays[0].origin, [ray.direction for ray in rays])
        meet = self._meet(hierarchy, rays, intervals)
        walk = Walk(hierarchy=hierarchy, beam=beam, meet=meet, pipelined=self._pipelined(hierarchy))
        return nearest(walk, closer=self.configuration["nearest"], limits=limits, width=width)

    def nearer(self, hierarchy: Hierarchy, before: NearestHit, distance: Any, number: Any) -> NearestHit:
        """Return what is nearer, what was hit before or a hit in a tree."""
        met = distance < dr.inf
        index = hierarchy.shape(number, met)
        closer = self.configuration["nearest"]
        take = closer(distance, before.distance) | (met & (distance == before.distance) & (index < before.shape))
        return NearestHit(
            distance=dr.select(take, distance, before.distance),
            shape=dr.select(take, index, before.shape),
            face=dr.select(take, hierarchy.face(number, met), before.face),
            number=number if hierarchy is self.forest else before.number,
        )

    def blocked(self, feelers: Sequence[Feeler], light: Any, blocked: list[Any]) -> list[Any]:
        """Return where a feeler is `blocked` already, or by a shape in a tree.

        They all end at `light` [m], and through a tree they go as one beam from there; the formulas are asked about the
        feelers as they are, so that a strategy against acne means the same either way.
        """
        obstructed = self.configuration["obstructed"]
        rays, intervals = [feeler.ray for feeler in feelers], [feeler.interval for feeler in feelers]
        if self.hierarchies:
            self.parameters.store(light)
            rays = prepared(rays)
        for hierarchy in self.hierarchies:
            active = [feeler.active & ~there for there, feeler in zip(blocked, feelers, strict=True)]
            triangles = hierarchy is self.forest

            def walk(
                group: Sequence[Any], turn: Any, hierarchy: Hierarchy = hierarchy, triangles: bool = triangles
            ) -> Any:
                beam, farthest = self._feeling(hierarchy, rays, light, group)
                alike = turning_alike(rays, turn) if triangles else rays
                meet = self._meet(hierarchy, alike, intervals)
                return Walk(hierarchy=hierarchy, beam=beam, meet=meet, pipelined=self._pipelined(hierarchy)), farthest

            met = any_hit_in_groups(
                hierarchy.types,
                walk,
                points=[ray.origin for ray in rays],
                alike=turns(rays) if triangles else [()] * len(rays),
                columns=self.plan.columns,
                skips=None if feelers[0].skip is None else self._skips(hierarchy, feelers),
                active=active,
                width=max(dr.width(ray.origin) for ray in rays),
            )
            blocked = [there | obstructed(distance) for there, distance in zip(blocked, met, strict=True)]
        return blocked

    def _feeling(
        self, hierarchy: Hierarchy, rays: Sequence[Ray], light: Any, active: Sequence[Any]
    ) -> tuple[Beam, Any]:
        """Return what bounds the feelers on their way through a tree, and the t of its end."""
        Single: Any = dr.float32_array_t(self.types.Float)
        if self.configuration.formula("segment").facts.get("bounded", False):
            reaches = [ray.origin - light for ray in rays]
            return Beam(hierarchy.nodes, light, reaches, active=active), Single(WIDER)
        # A feeler that does not end at the light goes by itself.
        (ray,) = rays
        return Beam(hierarchy.nodes, ray.origin, [ray.direction]), Single(dr.inf)

    def _skips(self, hierarchy: Hierarchy, feelers: Sequence[Feeler]) -> Callable[[Any, int], Any]:
        return lambda number, k: hierarchy.shape(number, self.types.Bool(True)) == feelers[k].skip
