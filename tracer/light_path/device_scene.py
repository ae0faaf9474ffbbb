"""All shapes of a scene on the device: the nearest hit, and whether anything is in the way.

Few shapes are unrolled into the kernel, one formula each; many of a kind, and all triangles of meshes, go through a
tree (`tracer.plan`). A scene without spheres leaves no sphere code behind, and a shape at identity no transform.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

from rayproof.cases.scene import Vector
from rayproof.tracer.plan import Context
from rayproof.tracer.rays import Feeler, Interval, NearestHit, Ray
from rayproof.tracer.shapes.primitives import traced
from rayproof.tracer.shapes.shape import TracedShape, Transform
from rayproof.tracer.trees.trees import Hierarchies
from rayproof.tracer.trees.unrolled import UnrolledShapes


class DeviceScene:
    """A scene's shapes in one precision."""

    def __init__(self, context: Context) -> None:
        self.context, self.scene, self.types = context, context.scene, context.types
        self.configuration, self.plan = context.configuration, context.plan
        self.buffers, self.parameters = context.buffers, context.parameters

    def parameter(self, index: int, what: str, value: Any) -> Any:
        """Return a number or vector that belongs to a shape, as a parameter of the kernel."""
        return self.parameters(f"shape {index} {what}", value)

    @cached_property
    def shapes(self) -> tuple[TracedShape, ...]:
        """Return its shapes."""
        return tuple(map(traced, self.scene.shapes))

    @cached_property
    def transforms(self) -> tuple[Transform, ...]:
        """Return where each shape stands."""
        return tuple(
            Transform(to_world=shape.to_world, parameters=self.parameters, name=f"shape {index}")
            for index, shape in enumerate(self.scene.shapes)
        )

    @cached_property
    def bodies(self) -> UnrolledShapes:
        """Return the shapes that are unrolled."""
        return UnrolledShapes(self.context, transforms=self.transforms)

    @cached_property
    def trees(self) -> Hierarchies:
        """Return the shapes that stand in trees."""
        return Hierarchies(self.context)

    @property
    def has_blockers(self) -> bool:
        """Return whether any shape may stand between a point of the scene and a light above its horizon."""
        return len(self.shapes) > 1 or any(shape.can_shadow_itself for shape in self.shapes)

    def nearest(self, rays: Sequence[Ray], intervals: Sequence[Interval], *, narrow: bool = False) -> list[NearestHit]:
        """Return the nearest hits of rays from one point; at a tie the lower shape index, then the lower face index.

        `narrow` says that their directions hardly differ.
        """
        hits = self.bodies.nearest(rays, intervals)
        return self.trees.nearest(rays, intervals, hits, narrow=narrow)

    def blocked(self, feelers: Sequence[Feeler], light: Any, *, place: Vector | None) -> list[Any]:
        """Return where something other than the shape that it leaves out is met inside a feeler's interval.

        The feelers all end at `light` [m], `place` on the host if it is known there.
        """
        blocked = self.trees.blocked(feelers, light, self.bodies.blocked(feelers, place))
        return [there & feeler.active for there, feeler in zip(blocked, feelers, strict=True)]
