"""`DeviceScene` finds the nearest hit; the hit shape determines position, shading normal and albedo.

Few shapes are unrolled into the kernel, one formula each; many shapes of a kind, and all triangles of meshes, are in a
tree (`tracer.plan`). The kernel of a scene without spheres contains no sphere code, and that of a shape at identity no
transform.

The data of the hit shape are selected per pixel among the shapes, or read from a table if there are many shapes.
"""

import hashlib
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import drjit as dr
import numpy as np

from rayproof.cases.scene import Vector
from rayproof.tracer.plan import Context
from rayproof.tracer.rays import Interval, NearestHit, Ray, ShadowRay
from rayproof.tracer.shapes import bounds
from rayproof.tracer.shapes.meshes import TracedMesh
from rayproof.tracer.shapes.primitives import TracedCube, TracedSphere, traced
from rayproof.tracer.shapes.shape import GatheredTransform, TracedShape, Transform
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
        """Return the transform of each shape."""
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
        """Return the trees of the shapes that are not unrolled."""
        return Hierarchies(self.context)

    @cached_property
    def in_trees(self) -> bool:
        """Return whether any shape is in a tree."""
        return any(map(self.plan.in_tree, self.scene.shapes))

    @property
    def has_blockers(self) -> bool:
        """Return whether any shape may block the segment from a point of the scene to a light above its horizon."""
        return len(self.shapes) > 1 or any(shape.can_shadow_itself for shape in self.shapes)

    def nearest(self, rays: Sequence[Ray], intervals: Sequence[Interval], *, narrow: bool = False) -> list[NearestHit]:
        """Return the nearest hits of rays from one point; at a tie the lower shape index, then the lower face index.

        Set `narrow` if their directions hardly differ.
        """
        hits = self.bodies.nearest(rays, intervals)
        return self.trees.nearest(rays, intervals, hits, narrow=narrow) if self.in_trees else hits

    def blocked(self, shadow_rays: Sequence[ShadowRay], light: Any, *, place: Vector | None) -> list[Any]:
        """Return the masks of shadow rays that hit a shape, other than the one to be skipped, inside their interval.

        The shadow rays all end at `light` [m], `place` on the host if it is known there.
        """
        blocked = self.bodies.blocked(shadow_rays, place)
        blocked = self.trees.blocked(shadow_rays, light, blocked) if self.in_trees else blocked
        return [there & shadow_ray.active for there, shadow_ray in zip(blocked, shadow_rays, strict=True)]


Value = TypeVar("Value", bound=Hashable)


@dataclass(frozen=True, kw_only=True)
class HitShapes:
    """The shapes at the nearest hits of one ray per lane."""

    world: DeviceScene
    ray: Ray
    hit: NearestHit
    mask: Any  # which rays hit anything

    @property
    def shapes(self) -> tuple[TracedShape, ...]:
        """Return the scene's shapes."""
        return self.world.shapes

    def one(self, index: int) -> "OneShape":
        """Return one of the shapes as if every ray had hit it."""
        return OneShape(world=self.world, ray=self.ray, hit=self.hit, mask=self.mask, index=index)

    @cached_property
    def placed(self) -> bool:
        """Return whether object space is not world space for some shape."""
        return any(not shape.transform.identity for shape in self.shapes)

    def shows(self, index: int) -> Any:
        """Return the mask of pixels that show a shape."""
        return self.hit.shape == self.world.parameter(index, "number", self.world.types.Int(index))

    def choose(self, values: Iterable[Any], otherwise: Any) -> Any:
        """Return, per pixel, the value of the shape that was hit; a kernel may end after each shape."""
        parameters = self.world.parameters
        chosen = parameters.per_lane(otherwise, dr.width(self.hit.shape))
        for index, value in enumerate(values):
            chosen = dr.select(self.shows(index), value, chosen)
            parameters.store(chosen)
        return chosen

    def constant(self, name: str, of: Callable[[TracedShape], Value], upload: Callable[[Value], Any]) -> Any:
        """Return a constant of the shape that was hit, without a selection if all shapes share it."""
        values = [of(shape) for shape in self.shapes]
        if self.world.parameters.shared:
            # On a miss, the constant of the last shape, as below.
            return self._look_up([values[-1], *values], upload(values[0]), first=-1)
        if len(set(values)) == 1:
            return self.world.parameter(0, f"constant {name}", upload(values[0]))
        if self.world.plan.tables:
            return self._look_up(values, upload(values[0]))
        named = enumerate(values)
        *others, last = (self.world.parameter(index, f"constant {name}", upload(value)) for index, value in named)
        return self.choose(others, last)

    def _look_up(self, values: Sequence[Any], like: Any, *, first: int = 0) -> Any:
        """Return, per pixel, the value of the shape that was hit, from a table; `like` has the type of one.

        The table begins with the shape `first`, -1 for pixels that show none.
        """
        table = np.asarray(values, dtype=np.float64)
        # The name is a digest of the content: the same table has the same name in every trace of a scene.
        name = hashlib.sha256(table.tobytes()).hexdigest()[:16]
        numbers = self.world.buffers.floats(f"table {name}", self.world.types, lambda: table)
        in_trees = self.hit.shape >= first
        kind = self.world.types.Float if dr.is_mask_v(like) else type(like)
        value = dr.gather(kind, numbers, self.world.types.UInt(self.hit.shape - first), in_trees)
        return value > 0 if dr.is_mask_v(like) else value

    def kind(self, kind: type[TracedShape]) -> Any:
        """Return the mask of hits on shapes of a kind."""
        return self.constant("kind", lambda shape: type(shape) is kind, self.world.types.Bool) & self.mask

    def either(self, kind: type[TracedShape], value: Any, otherwise: Any) -> Any:
        """Return `value` where a shape of that kind was hit, else `otherwise`."""
        return dr.select(self.kind(kind), value, otherwise)

    def flat_normal(self) -> Any:
        """Return the object-space normal where a flat shape was hit."""
        return self.constant("normal", lambda shape: shape.flat_normal, lambda xyz: self.world.types.Vector(*xyz))

    def object_ray(self) -> Ray:
        """Return the ray in the object space of the shape that was hit."""
        return self.world.configuration["to_object"](self.ray, self.transform) if self.placed else self.ray

    @cached_property
    def transform(self) -> Any:
        """Return the model matrix of the shape that was hit, from tables."""
        transforms = [shape.transform for shape in self.shapes]
        Vector = self.world.types.Vector
        rows = [self._look_up([p.inverse[k] for p in transforms], Vector(0)) for k in range(3)]
        columns = [self._look_up([p.linear[:, k] for p in transforms], Vector(0)) for k in range(3)]
        translation = self._look_up([p.translation for p in transforms], Vector(0))
        return GatheredTransform(rows=rows, columns=columns, translation=translation)


@dataclass(frozen=True, kw_only=True)
class OneShape(HitShapes):
    """A single shape, as if every ray had hit it."""

    index: int

    @property
    def shapes(self) -> tuple[TracedShape, ...]:
        """Return a tuple of only this shape."""
        return (self.world.shapes[self.index],)

    @cached_property
    def transform(self) -> Any:
        """Return its model matrix."""
        return self.world.transforms[self.index]

    def constant(self, name: str, of: Callable[[TracedShape], Value], upload: Callable[[Value], Any]) -> Any:
        """Return a constant of the shape."""
        return self.world.parameter(self.index, name, upload(of(*self.shapes)))

    def kind(self, kind: type[TracedShape]) -> Any:
        """Return the mask of hits on the shape, which is of that kind."""
        return self.shows(self.index)

    def either(self, kind: type[TracedShape], value: Any, otherwise: Any) -> Any:
        """Return the value: the shape is of that kind."""
        return value

    def flat_normal(self) -> Any:
        """Return its object-space normal, if it is flat; the same number in every kernel if its kind has one."""
        (shape,) = self.shapes
        normal = self.world.types.Vector(*shape.flat_normal)
        return self.world.parameter(self.index, "normal", normal) if shape.own_normal else normal


@dataclass(frozen=True, kw_only=True)
class SurfacePoint:
    """The properties of a surface that determine its light, at the hit of a ray."""

    met: HitShapes
    position: Any  # m; undefined on a miss
    normal: Any  # the shading normal N, 0 on a miss
    hidden: Any  # mask: a one-sided surface shows its back
    albedo: Any  # per channel

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Return its arrays, except those of the hit."""
        return self.met.mask, self.position, self.normal, self.hidden, self.albedo


@dataclass(frozen=True, kw_only=True)
class ObjectRay:
    """The hit shape's object space for a formula of the position; nothing is computed before a call."""

    met: HitShapes

    def __call__(self) -> tuple[Ray, Callable[[Any], Any]]:
        """Return the ray in object space, and a function that transforms its points to world space."""
        shapes, to_object = self.met, self.met.world.configuration["to_object"]
        if shapes.world.plan.tables:
            return to_object(shapes.ray, shapes.transform), shapes.transform.point_to_world
        transforms = shapes.world.transforms
        rays = [shapes.ray if p.identity else to_object(shapes.ray, p) for p in transforms]
        local = Ray(
            origin=shapes.choose([ray.origin for ray in rays], shapes.ray.origin),
            direction=shapes.choose([ray.direction for ray in rays], shapes.ray.direction),
        )

        def to_world(point: Any) -> Any:
            return shapes.choose([point if p.identity else p.point_to_world(point) for p in transforms], point)

        return local, to_world

    def spheres(self) -> tuple[Any, Any, Any]:
        """Return the mask of hits on spheres, their centres and radii [m]."""
        shapes, types = self.met, self.met.world.types
        return (
            shapes.kind(TracedSphere),
            shapes.constant("center", lambda shape: shape.center, lambda center: types.Vector(*center)),
            shapes.constant("radius", lambda shape: shape.radius, types.Float),
        )


def hit_point(shapes: HitShapes) -> Any:
    """Return the hit points [m], undefined on a miss, and let a kernel end."""
    point = shapes.world.configuration["position"](shapes.ray, shapes.hit.distance, ObjectRay(met=shapes))
    shapes.world.parameters.store(point)
    return point


def _normal_of(shapes: HitShapes, position: Any) -> Any:
    """Return the world normals of some shapes: each kind's formula once, and then the matrix."""
    normal, kinds = shapes.flat_normal(), {type(shape) for shape in shapes.shapes}
    curved = [kind for kind in (TracedSphere, TracedCube, TracedMesh) if kind in kinds]
    point = shapes.transform.point_to_object(position) if curved and shapes.placed else position
    for kind in curved:
        normal = shapes.either(kind, kind.normal(shapes, point), normal)
    return shapes.world.configuration["world_normal"](normal, shapes.transform) if shapes.placed else normal


def _facing(shapes: HitShapes, normal: Any) -> Any:
    """Return the normals, those of two-sided shapes turned to the viewer; computed once for all shapes."""
    if not any(shape.shape.two_sided for shape in shapes.shapes):
        return normal
    two_sided = shapes.constant("two-sided", lambda shape: shape.shape.two_sided, shapes.world.types.Bool)
    return dr.select(two_sided, shapes.world.configuration["facing"](normal, shapes.ray.direction), normal)


def shading_normal(shapes: HitShapes, position: Any) -> Any:
    """Return the shading normals N, 0 on a miss."""
    if shapes.world.plan.tables:
        return _facing(shapes, dr.select(shapes.mask, _normal_of(shapes, position), 0))
    normals = (_normal_of(shapes.one(index), position) for index in range(len(shapes.shapes)))
    return _facing(shapes, shapes.choose(normals, shapes.world.types.Vector(0)))


def surface(shapes: HitShapes, position: Any, normal: Any) -> SurfacePoint:
    """Return the surface with this position [m] and this shading normal."""
    types = shapes.world.types
    one_sided = shapes.constant("one-sided", lambda shape: not shape.shape.two_sided, types.Bool)
    return SurfacePoint(
        met=shapes,
        position=position,
        normal=normal,
        hidden=shapes.world.configuration["hidden"](normal, shapes.ray.direction) & one_sided,
        albedo=shapes.constant("albedo", lambda shape: shape.shape.albedo, lambda rgb: types.Vector(*rgb)),
    )


def clearance(shapes: HitShapes) -> Any:
    """Return the bound [m] of the hit points' errors along the normal (see `tracer.shapes.bounds`)."""
    types, forest = shapes.world.types, shapes.world.trees.forest

    def spread(shape: TracedShape) -> float:
        return float(shape.spreads()[0]) if shape.single else 1.0  # a mesh has a spread per triangle

    wide: Any = 1.0
    if any(spread(shape) != 1 for shape in shapes.shapes):
        wide = shapes.constant("spread", spread, types.Float)
    size = shapes.constant("extent", lambda shape: bounds.extent(shape.shape) if shape.single else 0.0, types.Float)
    if forest is not None:
        kind = shapes.kind(TracedMesh)
        wide = dr.select(kind, forest.slenderness(shapes.hit.number, kind), wide)
        size = dr.select(kind, forest.reach(shapes.hit.number, kind), size)
    scale = dr.norm(shapes.ray.origin) + shapes.hit.distance + size
    return bounds.clearance(scale, spread=wide, precision=types.precision)
