"""Shapes unrolled into the kernel, one formula each, passed over where no ray of a packet meets the shape's cone.

A lane of one ray asks every formula. Where a lane takes several, asking for the cone about a shape
(`tracer.trees.beams`) costs little beside as many formulas, and most packets can meet few of the shapes. The cone is
about the true shape: a formula that is wrong on purpose meets others, and is always asked.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import drjit as dr

from rayproof.cases.scene import Vector
from rayproof.tracer.kernel.arrays import where
from rayproof.tracer.plan import Context
from rayproof.tracer.rays import Interval, NearestHit, Ray, ShadowRay
from rayproof.tracer.shapes.primitives import traced
from rayproof.tracer.shapes.shape import TracedShape, Transform
from rayproof.tracer.trees.beams import Cone, Directions, cone


@dataclass(frozen=True, kw_only=True)
class UnrolledShape:
    """A shape that has a formula of its own."""

    index: int
    number: Any  # the same on the device
    shape: TracedShape
    transform: Transform
    arrays: Any


class UnrolledShapes:
    """The unrolled shapes of a scene, in one precision."""

    def __init__(self, context: Context, *, transforms: Sequence[Transform]) -> None:
        """Take the shapes of a scene that the plan puts into no tree."""
        self.scene, self.configuration, self.types = context.scene, context.configuration, context.types
        self.parameters, self._plan, self._placements = context.parameters, context.plan, transforms

    def _kept(self, index: int, record: Any) -> Any:
        """Return a shape's device record with its arrays as parameters."""
        arrays = {one.name: getattr(record, one.name) for one in fields(record)}
        kept = {
            name: self.parameters(f"shape {index} {name}", value)
            for name, value in arrays.items()
            if dr.is_array_v(value)
        }
        return replace(record, **kept)

    @cached_property
    def each(self) -> tuple[UnrolledShape, ...]:
        """Return the bodies, without degenerate triangles."""
        return tuple(
            UnrolledShape(
                index=index,
                number=self.parameters(f"shape {index} number", self.types.Int(index)),
                shape=shape,
                transform=self._placements[index],
                arrays=self._kept(index, shape.arrays(self.types)),
            )
            for index, shape in enumerate(map(traced, self.scene.shapes))
            if not self._plan.in_tree(shape.shape) and not shape.empty
        )

    def _object_ray(self, body: UnrolledShape, ray: Ray) -> Ray:
        """Return the ray in a body's object space, the ray itself where that is world space."""
        return ray if body.transform.identity else self.configuration["to_object"](ray, body.transform)

    def _distance(self, body: UnrolledShape, ray: Ray, interval: Interval) -> Any:
        formula = self.configuration.formula(body.shape.slot)
        seen = self._object_ray(body, ray) if formula.facts.get("space") == "object" else ray
        return formula.function(seen, body.arrays, interval)

    def nearest(self, rays: Sequence[Ray], intervals: Sequence[Interval]) -> list[NearestHit]:
        """Return the nearest hits of rays from the eye; at a tie the lower shape index."""
        closer, Float, Int = self.configuration["nearest"], self.types.Float, self.types.Int
        width = max(dr.width(ray.direction) for ray in rays)
        best = [self.parameters.per_lane(Float(dr.inf), width) for _ in rays]
        shape = [self.parameters.per_lane(Int(-1), width) for _ in rays]
        asked = self._seen(rays)
        for body in self.each:

            def meet(body: UnrolledShape = body) -> list[Any]:
                return [self._distance(body, *one) for one in zip(rays, intervals, strict=True)]

            some = asked(body)
            for k, distance in enumerate(meet() if some is None else where(some, meet, [Float(dr.inf)] * len(rays))):
                take = closer(distance, best[k])
                best[k] = dr.select(take, distance, best[k])
                shape[k] = dr.select(take, body.number, shape[k])
            # Then scenes share a kernel for each kind of body, however many they have of it and in whatever order.
            self.parameters.store(best, shape)
        return [
            NearestHit(distance=t, shape=index, face=dr.select(index >= 0, Int(0), -1), number=None)
            for t, index in zip(best, shape, strict=True)
        ]

    def blocked(self, shadow_rays: Sequence[ShadowRay], light: Vector | None) -> list[Any]:
        """Return where a body other than the one that it leaves out is met inside a shadow ray's interval.

        `light` [m] is where they end, None where the kernel reads it from memory.
        """
        obstructed = self.configuration["obstructed"]
        width = max(dr.width(shadow_ray.ray.origin) for shadow_ray in shadow_rays)
        blocked = [self.parameters.per_lane(self.types.Bool(False), width) for _ in shadow_rays]
        missed = obstructed(self.types.Float(dr.inf))
        asked = self._felt(shadow_rays, light)
        for body in self.each:

            def meet(body: UnrolledShape = body) -> list[Any]:
                distances = [self._distance(body, one.ray, one.interval) for one in shadow_rays]
                return [
                    obstructed(t if one.skip is None else dr.select(one.skip == body.number, dr.inf, t))
                    for one, t in zip(shadow_rays, distances, strict=True)
                ]

            some = asked(body)
            found = meet() if some is None else where(some, meet, [missed] * len(shadow_rays))
            blocked = [there | one for there, one in zip(blocked, found, strict=True)]
            self.parameters.store(blocked)
        return blocked

    def _right(self, body: UnrolledShape) -> bool:
        """Return whether a ray that misses a body's ball is sure to miss it by the formulas, too."""
        slots = (body.shape.slot, "to_object")
        return all(self.configuration.formula(slot).kind == "right" for slot in slots)

    def _cone(self, body: UnrolledShape, origin: Vector) -> Cone | None:
        # Whatever is computed in doubles, eye and light have the configuration's precision.
        return cone(body.shape, origin, self.configuration.precision) if self._right(body) else None

    def _seen(self, rays: Sequence[Ray]) -> Callable[[UnrolledShape], Any]:
        """Return what says in which lanes a body may be met by rays from the eye; None where nobody knows."""
        if len(rays) == 1:
            return lambda body: None
        directions = Directions([ray.direction for ray in rays], self.types)
        self.parameters.store(directions.arrays)

        def asked(body: UnrolledShape) -> Any:
            about = self._cone(body, self.scene.camera.eye)
            name = f"shape {body.index} from the eye"
            return about and about.may_meet(directions, self.types, self.parameters, name=name)

        return asked

    def _felt(self, shadow_rays: Sequence[ShadowRay], light: Vector | None) -> Callable[[UnrolledShape], Any]:
        """Return what says in which lanes a body may be met by shadow rays; None where nobody knows."""
        # A shadow ray that does not end at the light meets what stands behind it, too.
        segment = self.configuration.formula("segment")
        known = segment.kind == "right" and segment.facts.get("bounded", False)
        if len(shadow_rays) == 1 or light is None or not known:
            return lambda body: None
        active = [shadow_ray.active for shadow_ray in shadow_rays]
        directions = Directions([shadow_ray.ray.direction for shadow_ray in shadow_rays], self.types, active=active)
        self.parameters.store(directions.arrays)

        def asked(body: UnrolledShape) -> Any:
            if body.shape.endless:
                return self._crossing(body, shadow_rays) if self._right(body) else None
            about = self._cone(body, light)
            name = f"shape {body.index} from {light}"
            return about and about.reversed.may_meet(directions, self.types, self.parameters, name=name)

        return asked

    def _crossing(self, plane: UnrolledShape, shadow_rays: Sequence[ShadowRay]) -> Any:
        """Return in which lanes a shadow ray goes towards the plane: only then t is not negative."""
        some = self.types.Bool(False)
        for shadow_ray in shadow_rays:
            ray = self._object_ray(plane, shadow_ray.ray)
            some |= shadow_ray.active & ~(ray.origin.z * ray.direction.z > 0)
        return some
