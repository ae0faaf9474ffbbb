"""Shapes unrolled into the kernel, one formula each, skipped if no ray of a packet is inside the shape's cone.

A lane with a single ray evaluates every formula. If a lane has several rays, the test of the cone about a shape
(`tracer.trees.beams`) costs little compared with as many formulas, and most packets can hit only few of the shapes. The
cone is that of the true shape: a formula that is wrong on purpose has other hits, and is always evaluated.
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
        arrays = {field.name: getattr(record, field.name) for field in fields(record)}
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
        """Return the ray in a body's object space, or the ray itself if that is world space."""
        return ray if body.transform.identity else self.configuration["to_object"](ray, body.transform)

    def _distance(self, body: UnrolledShape, ray: Ray, interval: Interval) -> Any:
        formula = self.configuration.formula(body.shape.slot)
        local_ray = self._object_ray(body, ray) if formula.facts.get("space") == "object" else ray
        return formula.function(local_ray, body.arrays, interval)

    def nearest(self, rays: Sequence[Ray], intervals: Sequence[Interval]) -> list[NearestHit]:
        """Return the nearest hits of rays from the eye; at a tie the lower shape index."""
        closer, Float, Int = self.configuration["nearest"], self.types.Float, self.types.Int
        width = max(dr.width(ray.direction) for ray in rays)
        best = [self.parameters.per_lane(Float(dr.inf), width) for _ in rays]
        shape = [self.parameters.per_lane(Int(-1), width) for _ in rays]
        may_hit = self._seen(rays)
        for body in self.each:

            def meet(body: UnrolledShape = body) -> list[Any]:
                return [self._distance(body, *arguments) for arguments in zip(rays, intervals, strict=True)]

            mask = may_hit(body)
            for k, distance in enumerate(meet() if mask is None else where(mask, meet, [Float(dr.inf)] * len(rays))):
                take = closer(distance, best[k])
                best[k] = dr.select(take, distance, best[k])
                shape[k] = dr.select(take, body.number, shape[k])
            # Then scenes share a kernel for each kind of body, whatever the number and order of their bodies.
            self.parameters.store(best, shape)
        return [
            NearestHit(distance=t, shape=index, face=dr.select(index >= 0, Int(0), -1), number=None)
            for t, index in zip(best, shape, strict=True)
        ]

    def blocked(self, shadow_rays: Sequence[ShadowRay], light: Vector | None) -> list[Any]:
        """Return the mask of shadow rays that hit a shape, other than the one to be skipped, inside their interval.

        `light` [m] is their end, None if the kernel reads it from memory.
        """
        obstructed = self.configuration["obstructed"]
        width = max(dr.width(shadow_ray.ray.origin) for shadow_ray in shadow_rays)
        blocked = [self.parameters.per_lane(self.types.Bool(False), width) for _ in shadow_rays]
        missed = obstructed(self.types.Float(dr.inf))
        may_hit = self._felt(shadow_rays, light)
        for body in self.each:

            def meet(body: UnrolledShape = body) -> list[Any]:
                distances = [self._distance(body, shadow_ray.ray, shadow_ray.interval) for shadow_ray in shadow_rays]
                return [
                    obstructed(t if shadow_ray.skip is None else dr.select(shadow_ray.skip == body.number, dr.inf, t))
                    for shadow_ray, t in zip(shadow_rays, distances, strict=True)
                ]

            mask = may_hit(body)
            hits = meet() if mask is None else where(mask, meet, [missed] * len(shadow_rays))
            blocked = [there | hit for there, hit in zip(blocked, hits, strict=True)]
            self.parameters.store(blocked)
        return blocked

    def _right(self, body: UnrolledShape) -> bool:
        """Return whether a ray that misses a body's ball certainly misses the body by the formulas, too."""
        slots = (body.shape.slot, "to_object")
        return all(self.configuration.formula(slot).kind == "right" for slot in slots)

    def _cone(self, body: UnrolledShape, origin: Vector) -> Cone | None:
        # Eye and light have the configuration's precision, even if some formulas compute in float64.
        return cone(body.shape, origin, self.configuration.precision) if self._right(body) else None

    def _seen(self, rays: Sequence[Ray]) -> Callable[[UnrolledShape], Any]:
        """Return a culling predicate for camera rays (the mask of lanes that may hit a shape), or None."""
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
        """Return a culling predicate for shadow rays (the mask of lanes that may hit a shape), or None."""
        # A shadow ray that does not end at the light also hits shapes behind it.
        segment = self.configuration.formula("segment")
        ends_at_light = segment.kind == "right" and segment.facts.get("bounded", False)
        if len(shadow_rays) == 1 or light is None or not ends_at_light:
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
        """Return the mask of lanes with a shadow ray towards the plane, which t >= 0 requires."""
        crossing = self.types.Bool(False)
        for shadow_ray in shadow_rays:
            ray = self._object_ray(plane, shadow_ray.ray)
            crossing |= shadow_ray.active & ~(ray.origin.z * ray.direction.z > 0)
        return crossing
