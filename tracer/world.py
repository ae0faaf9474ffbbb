"""All shapes of a scene on the device: the nearest hit, and whether anything is in the way.

Few shapes are unrolled into the kernel, one formula each; the triangles of all meshes go through one tree. A scene
without spheres leaves no sphere code behind, and a shape at identity no transform.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr

from cases.scene import Mesh, Scene, Shape, Triangle
from tracer.acceleration.forest import Forest, host_forest
from tracer.acceleration.traverse import Walk, any_hit, nearest
from tracer.arrays import ArrayTypes
from tracer.configuration import Configuration
from tracer.geometry import SLOTS, upload
from tracer.placement import Placement
from tracer.rays import Interval, Ray
from tracer.triangles import degenerate, object_normals


@dataclass(frozen=True, kw_only=True)
class Body:
    """A shape that has a formula of its own."""

    index: int
    slot: str
    placement: Placement
    arrays: Any


@dataclass(frozen=True, kw_only=True)
class Nearest:
    """The nearest hit per ray: t [m] or inf, shape and face index or -1, and the triangle's number in the tree."""

    distance: Any
    shape: Any
    face: Any
    number: Any  # None without meshes


def can_shadow_itself(shape: Shape) -> bool:
    """Return whether a shape may stand between a point of its own and a light above that point's horizon.

    A convex body with its normal outward cannot, and neither can a flat one; a two-sided body is lit from inside.
    """
    flat_or_convex = SLOTS.get(type(shape))
    return flat_or_convex is None or (shape.two_sided and flat_or_convex in ("sphere", "cube"))


def flat_normal(shape: Shape) -> tuple[float, float, float]:
    """Return the object-space normal of a plane, a square or a triangle."""
    if not isinstance(shape, Triangle):
        return (0.0, 0.0, 1.0)
    x, y, z = map(float, object_normals(shape)[0])
    return x, y, z


class World:
    """A scene's shapes in one precision."""

    def __init__(self, scene: Scene, configuration: Configuration, types: ArrayTypes) -> None:
        self.scene, self.configuration, self.types = scene, configuration, types

    @cached_property
    def bodies(self) -> tuple[Body, ...]:
        """Return the shapes with a formula of their own, without degenerate triangles."""
        return tuple(
            Body(
                index=index,
                arrays=upload(shape, self.types),
                slot=SLOTS[type(shape)],
                placement=Placement(to_world=shape.to_world),
            )
            for index, shape in enumerate(self.scene.shapes)
            if not isinstance(shape, Mesh) and not (SLOTS.get(type(shape)) == "triangle" and degenerate(shape)[0])
        )

    @cached_property
    def forest(self) -> Forest | None:
        """Return the tree over all meshes, or None without meshes."""
        meshes = tuple((index, shape) for index, shape in enumerate(self.scene.shapes) if isinstance(shape, Mesh))
        host = host_forest(meshes) if meshes else None
        return None if host is None else Forest(host, self.types)

    @property
    def has_blockers(self) -> bool:
        """Return whether any shape may stand between a point of the scene and a light above its horizon."""
        return len(self.scene.shapes) > 1 or any(can_shadow_itself(shape) for shape in self.scene.shapes)

    def object_ray(self, body: Body, ray: Ray) -> Ray:
        """Return the ray in a body's object space, the ray itself where that is world space."""
        return ray if body.placement.identity else self.configuration["to_object"](ray, body.placement)

    def _distance(self, body: Body, ray: Ray, interval: Interval) -> Any:
        formula = self.configuration.formula(body.slot)
        seen = self.object_ray(body, ray) if formula.facts["space"] == "object" else ray
        return formula.function(seen, body.arrays, interval)

    def nearest(self, ray: Ray, interval: Interval) -> Nearest:
        """Return the nearest hit inside the interval; at a tie the lower shape index, then the lower face index."""
        closer = self.configuration["nearest"]
        best, shape, face, number = self.types.Float(dr.inf), self.types.Int(-1), self.types.Int(-1), None
        for body in self.bodies:
            distance = self._distance(body, ray, interval)
            take = closer(distance, best)
            best = dr.select(take, distance, best)
            shape = dr.select(take, body.index, shape)
            face = dr.select(take, 0, face)
        if self.forest is not None:
            walk = Walk(self.forest, ray, interval, self.configuration["triangle"])
            distance, number = nearest(walk, closer=closer, limit=best, active=self.types.Bool(True))
            found = distance < dr.inf
            index = self.forest.shape(number, found)
            take = closer(distance, best) | (found & (distance == best) & (index < shape))
            best = dr.select(take, distance, best)
            shape = dr.select(take, index, shape)
            face = dr.select(take, self.forest.face(number, found), face)
        return Nearest(distance=best, shape=shape, face=face, number=number)

    def blocked(self, ray: Ray, interval: Interval, *, skip: Any, active: Any) -> Any:
        """Return where something other than the shape `skip` (or None) is met inside the interval."""
        obstructed = self.configuration["obstructed"]
        blocked = self.types.Bool(False)
        for body in self.bodies:
            distance = self._distance(body, ray, interval)
            if skip is not None:
                distance = dr.select(skip == body.index, dr.inf, distance)
            blocked |= obstructed(distance)
        if self.forest is not None:
            walk = Walk(self.forest, ray, interval, self.configuration["triangle"])
            blocked |= obstructed(any_hit(walk, skip=skip, active=active & ~blocked))
        return blocked & active
