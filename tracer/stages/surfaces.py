"""The surfaces that rays hit: position, normal, albedo, and how far off the position may be."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from rayproof.cases.scene import Cube, Mesh, Shape, Sphere, Triangle
from rayproof.tracer.rays import Ray
from rayproof.tracer.shapes import error_bounds
from rayproof.tracer.shapes.error_bounds import extent, spread
from rayproof.tracer.shapes.triangles import object_normals
from rayproof.tracer.stages.hit_attributes import HitShapes, OneShape


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
            met.constant("is a sphere", lambda shape: isinstance(shape, Sphere), types.Bool) & met.mask,
            met.constant("center", _center, lambda center: types.Vector(*center)),
            met.constant("radius", lambda shape: shape.radius if isinstance(shape, Sphere) else 1.0, types.Float),
        )


def _center(shape: Shape) -> tuple[float, float, float]:
    """Return a sphere's centre; of other shapes nothing that counts."""
    return shape.center if isinstance(shape, Sphere) else (0.0, 0.0, 0.0)


def _spread(shape: Shape) -> float:
    """Return what multiplies the rounding errors of all of a shape; a mesh has one a triangle."""
    return 1.0 if isinstance(shape, Mesh) else spread(shape)


def _flat_normal(shape: Shape) -> tuple[float, float, float]:
    """Return the object-space normal of a plane, a square or a triangle; of other shapes nothing that counts."""
    if not isinstance(shape, Triangle):
        return (0.0, 0.0, 1.0)
    x, y, z = map(float, object_normals(shape)[0])
    return x, y, z


def hit_point(met: HitShapes) -> Any:
    """Return the hit points [m], and let a kernel end; where nothing was hit they mean nothing."""
    found = met.world.configuration["position"](met.ray, met.hit.distance, ObjectRay(met=met))
    met.world.parameters.store(found)
    return found


def _normal_of(some: HitShapes | OneShape, position: Any) -> Any:
    """Return the world normals of some shapes: each kind's formula once, and then the matrix."""
    met, configuration, Vector = some.met, some.met.world.configuration, some.met.world.types.Vector
    point = some.transform.point_to_object(position) if some.placed else position
    normal = some.constant("normal", _flat_normal, lambda xyz: Vector(*xyz))
    if Sphere in some.kinds:
        center = some.constant("center", _center, lambda xyz: Vector(*xyz))
        normal = some.either(Sphere, configuration["sphere_normal"](point, center), normal)
    if Cube in some.kinds:
        if configuration.formula("cube_normal").facts.get("takes") == "ray":
            ray = configuration["to_object"](met.ray, some.transform) if some.placed else met.ray
            cube = configuration["cube_normal"](ray, met.hit.distance)
        else:
            cube = configuration["cube_normal"](point)
        normal = some.either(Cube, cube, normal)
    forest = met.world.trees.forest
    if Mesh in some.kinds and forest is not None:
        normal = some.either(Mesh, forest.normal(met.hit.number, some.kind(Mesh)), normal)
    return configuration["world_normal"](normal, some.transform) if some.placed else normal


def _facing(met: HitShapes, normal: Any) -> Any:
    """Return the normals, those of two-sided shapes turned to the viewer: once, whichever shape was hit."""
    if not any(shape.two_sided for shape in met.shapes):
        return normal
    two_sided = met.constant("two-sided", lambda shape: shape.two_sided, met.world.types.Bool)
    return dr.select(two_sided, met.world.configuration["facing"](normal, met.ray.direction), normal)


def shading_normal(met: HitShapes, position: Any) -> Any:
    """Return the shading normals N, 0 where nothing was hit."""
    if met.world.plan.tables:
        return _facing(met, dr.select(met.mask, _normal_of(met, position), 0))
    each = (_normal_of(OneShape(met=met, index=index), position) for index in range(len(met.shapes)))
    return _facing(met, met.choose(each, met.world.types.Vector(0)))


def surface(met: HitShapes, position: Any, normal: Any) -> Surface:
    """Return the surface with this position [m] and this shading normal."""
    types = met.world.types
    one_sided = met.constant("one-sided", lambda shape: not shape.two_sided, types.Bool)
    return Surface(
        met=met,
        position=position,
        normal=normal,
        hidden=met.world.configuration["hidden"](normal, met.ray.direction) & one_sided,
        albedo=met.constant("albedo", lambda shape: shape.albedo, lambda rgb: types.Vector(*rgb)),
    )


def clearance(met: HitShapes) -> Any:
    """Return how far along the normal the hit points may be off [m] (see `tracer.shapes.error_bounds`)."""
    types, forest = met.world.types, met.world.trees.forest
    wide: Any = 1.0
    if any(_spread(shape) != 1 for shape in met.shapes):
        wide = met.constant("spread", _spread, types.Float)
    if forest is not None:
        kind = met.kind(Mesh)
        wide = dr.select(kind, forest.slenderness(met.hit.number, kind), wide)
    scale = dr.norm(met.ray.origin) + met.hit.distance + met.constant("extent", extent, types.Float)
    return error_bounds.clearance(scale, spread=wide, precision=types.precision)
