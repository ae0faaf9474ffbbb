"""The surfaces that rays hit: position, normal, albedo, and how far off the position may be."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from rayproof.tracer.rays import Ray
from rayproof.tracer.shapes import error_bounds
from rayproof.tracer.shapes.cube import TracedCube
from rayproof.tracer.shapes.shape import TracedShape
from rayproof.tracer.shapes.sphere import TracedSphere
from rayproof.tracer.shapes.triangles import TracedMesh
from rayproof.tracer.stages.hit_attributes import HitShapes


@dataclass(frozen=True, kw_only=True)
class Surface:
    """What light needs to know of the surface that one ray hit."""

    met: HitShapes
    position: Any  # m; where nothing was hit it means nothing
    normal: Any  # the shading normal N, 0 where nothing was hit
    hidden: Any  # where a one-sided surface shows its back
    albedo: Any  # per channel

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Return all that it is made of, but for the hit."""
        return self.met.mask, self.position, self.normal, self.hidden, self.albedo


@dataclass(frozen=True, kw_only=True)
class ObjectRay:
    """What a formula for the position may ask about the shape that was hit; nothing is computed before."""

    met: HitShapes

    def __call__(self) -> tuple[Ray, Callable[[Any], Any]]:
        """Return the ray in object space, and what takes its points to world space."""
        met, to_object = self.met, self.met.world.configuration["to_object"]
        if met.world.plan.tables:
            return to_object(met.ray, met.transform), met.transform.point_to_world
        transforms = met.world.transforms
        rays = [met.ray if p.identity else to_object(met.ray, p) for p in transforms]
        local = Ray(
            origin=met.choose([ray.origin for ray in rays], met.ray.origin),
            direction=met.choose([ray.direction for ray in rays], met.ray.direction),
        )

        def to_world(point: Any) -> Any:
            return met.choose([point if p.identity else p.point_to_world(point) for p in transforms], point)

        return local, to_world

    def spheres(self) -> tuple[Any, Any, Any]:
        """Return where a sphere was hit, and its centre and radius [m]."""
        met, types = self.met, self.met.world.types
        return (
            met.kind(TracedSphere),
            met.constant("center", lambda shape: shape.center, lambda center: types.Vector(*center)),
            met.constant("radius", lambda shape: shape.radius, types.Float),
        )


def hit_point(met: HitShapes) -> Any:
    """Return the hit points [m], and let a kernel end; where nothing was hit they mean nothing."""
    found = met.world.configuration["position"](met.ray, met.hit.distance, ObjectRay(met=met))
    met.world.parameters.store(found)
    return found


def _normal_of(some: HitShapes, position: Any) -> Any:
    """Return the world normals of some shapes: each kind's formula once, and then the matrix."""
    normal, kinds = some.flat_normal(), {type(shape) for shape in some.shapes}
    curved = [kind for kind in (TracedSphere, TracedCube, TracedMesh) if kind in kinds]
    point = some.transform.point_to_object(position) if curved and some.placed else position
    for kind in curved:
        normal = some.either(kind, kind.normal(some, point), normal)
    return some.world.configuration["world_normal"](normal, some.transform) if some.placed else normal


def _facing(met: HitShapes, normal: Any) -> Any:
    """Return the normals, those of two-sided shapes turned to the viewer: once, whichever shape was hit."""
    if not any(shape.shape.two_sided for shape in met.shapes):
        return normal
    two_sided = met.constant("two-sided", lambda shape: shape.shape.two_sided, met.world.types.Bool)
    return dr.select(two_sided, met.world.configuration["facing"](normal, met.ray.direction), normal)


def shading_normal(met: HitShapes, position: Any) -> Any:
    """Return the shading normals N, 0 where nothing was hit."""
    if met.world.plan.tables:
        return _facing(met, dr.select(met.mask, _normal_of(met, position), 0))
    each = (_normal_of(met.one(index), position) for index in range(len(met.shapes)))
    return _facing(met, met.choose(each, met.world.types.Vector(0)))


def surface(met: HitShapes, position: Any, normal: Any) -> Surface:
    """Return the surface with this position [m] and this shading normal."""
    types = met.world.types
    one_sided = met.constant("one-sided", lambda shape: not shape.shape.two_sided, types.Bool)
    return Surface(
        met=met,
        position=position,
        normal=normal,
        hidden=met.world.configuration["hidden"](normal, met.ray.direction) & one_sided,
        albedo=met.constant("albedo", lambda shape: shape.shape.albedo, lambda rgb: types.Vector(*rgb)),
    )


def clearance(met: HitShapes) -> Any:
    """Return how far along the normal the hit points may be off [m] (see `tracer.shapes.error_bounds`)."""
    types, forest = met.world.types, met.world.trees.forest

    def spread(shape: TracedShape) -> float:
        return float(shape.spreads()[0]) if shape.single else 1.0  # a mesh has one a triangle

    wide: Any = 1.0
    if any(spread(shape) != 1 for shape in met.shapes):
        wide = met.constant("spread", spread, types.Float)
    if forest is not None:
        kind = met.kind(TracedMesh)
        wide = dr.select(kind, forest.slenderness(met.hit.number, kind), wide)
    size = met.constant("extent", lambda shape: error_bounds.extent(shape.shape), types.Float)
    scale = dr.norm(met.ray.origin) + met.hit.distance + size
    return error_bounds.clearance(scale, spread=wide, precision=types.precision)
