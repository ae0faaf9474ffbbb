"""The surfaces that rays hit: position, normal, albedo, and how far off the position may be."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr

from rayproof.cases.scene import Cube, Mesh, Shape, Sphere, Triangle
from rayproof.tracer.rays import NearestHit, Ray
from rayproof.tracer.shapes.error_bounds import clearance, extent, spread
from rayproof.tracer.shapes.transforms import Transform
from rayproof.tracer.shapes.triangles import object_normals
from rayproof.tracer.stages.hit_attributes import HitShapes
from rayproof.tracer.stages.intersector import World


@dataclass(frozen=True, kw_only=True)
class ObjectRay:
    """What a formula for the position may ask about the shape that was hit; nothing is computed before."""

    surfaces: "Surfaces"

    def __call__(self) -> tuple[Ray, Callable[[Any], Any]]:
        """Return the ray in object space, and what takes its points to world space."""
        return self.surfaces.object_ray()

    def spheres(self) -> tuple[Any, Any, Any]:
        """Return where a sphere was hit, and its centre and radius [m]."""
        return self.surfaces.spheres()


def _center(shape: Shape) -> tuple[float, float, float]:
    """Return a sphere's centre; of other shapes nothing that counts."""
    return shape.center if isinstance(shape, Sphere) else (0.0, 0.0, 0.0)


def _spread(shape: Shape) -> float:
    """Return what multiplies the rounding errors of all of a shape; a mesh has one a triangle."""
    return 1.0 if isinstance(shape, Mesh) else spread(shape)


def _constant_normal(shape: Shape) -> tuple[float, float, float]:
    """Return the object-space normal of a flat shape; of other shapes nothing that counts."""
    return (0.0, 0.0, 1.0) if isinstance(shape, Sphere | Cube | Mesh) else _flat_normal(shape)


def _flat_normal(shape: Shape) -> tuple[float, float, float]:
    """Return the object-space normal of a plane, a square or a triangle."""
    if not isinstance(shape, Triangle):
        return (0.0, 0.0, 1.0)
    x, y, z = map(float, object_normals(shape)[0])
    return x, y, z


class Surfaces:
    """The surfaces at the nearest hits of one bundle of rays."""

    def __init__(self, world: World, ray: Ray, hit: NearestHit, *, eye: Any) -> None:
        self.world, self.ray, self.hit, self.eye = world, ray, hit, eye
        self.shapes, self.types = world.scene.shapes, world.types
        self.configuration = world.configuration
        self._met = HitShapes(world, hit)

    @property
    def mask(self) -> Any:
        """Return which rays hit anything."""
        return self._met.mask

    @cached_property
    def _placed(self) -> bool:
        return any(not Transform(to_world=shape.to_world).identity for shape in self.shapes)

    @cached_property
    def position(self) -> Any:
        """Return the hit points [m]; where nothing was hit they mean nothing."""
        found = self.configuration["position"](self.ray, self.hit.distance, ObjectRay(surfaces=self))
        self.world.parameters.store(found)
        return found

    def object_ray(self) -> tuple[Ray, Callable[[Any], Any]]:
        """Return the ray in the object space of the shape that was hit, and what takes its points to world space."""
        to_object = self.configuration["to_object"]
        if self.world.plan.tables:
            return to_object(self.ray, self._met.transform), self._met.transform.point_to_world
        transforms = self.world.transforms
        rays = [self.ray if p.identity else to_object(self.ray, p) for p in transforms]
        local = Ray(
            origin=self._met.choose([ray.origin for ray in rays], self.ray.origin),
            direction=self._met.choose([ray.direction for ray in rays], self.ray.direction),
        )

        def to_world(point: Any) -> Any:
            return self._met.choose([point if p.identity else p.point_to_world(point) for p in transforms], point)

        return local, to_world

    def spheres(self) -> tuple[Any, Any, Any]:
        """Return where a sphere was hit, and its centre and radius [m]."""
        return (
            self._met.constant("is a sphere", lambda shape: isinstance(shape, Sphere), self.types.Bool) & self.mask,
            self._met.constant("center", _center, lambda center: self.types.Vector(*center)),
            self._met.constant(
                "radius", lambda shape: shape.radius if isinstance(shape, Sphere) else 1.0, self.types.Float
            ),
        )

    def _object_normal(self, index: int, shape: Shape, transform: Transform) -> Any:
        match shape:
            case Cube() if self.configuration.formula("cube_normal").facts.get("takes") == "ray":
                ray = self.ray if transform.identity else self.configuration["to_object"](self.ray, transform)
                return self.configuration["cube_normal"](ray, self.hit.distance)
            case Sphere() | Cube():
                point = self.position if transform.identity else transform.point_to_object(self.position)
                if isinstance(shape, Cube):
                    return self.configuration["cube_normal"](point)
                center = self.world.parameter(index, "center", self.types.Vector(*shape.center))
                return self.configuration["sphere_normal"](point, center)
            case Mesh():
                if self.world.trees.forest is None:
                    return self.types.Vector(0)
                return self.world.trees.forest.normal(self.hit.number, self._met.shows(index))
            case Triangle():
                return self.world.parameter(index, "normal", self.types.Vector(*_flat_normal(shape)))
            case _:
                return self.types.Vector(*_flat_normal(shape))

    def _normal(self, index: int, shape: Shape) -> Any:
        transform = self.world.transforms[index]
        normal = self._object_normal(index, shape, transform)
        if not transform.identity:
            normal = self.configuration["world_normal"](normal, transform)
        return normal

    def _looked_up_normal(self) -> Any:
        """Return the shading normals: every kind's formula once, and the matrices from tables."""
        kinds = {type(shape) for shape in self.shapes}
        point = self.position if not self._placed else self._met.transform.point_to_object(self.position)
        normal = self._met.constant("normal", _constant_normal, lambda xyz: self.types.Vector(*xyz))
        if Sphere in kinds:
            center = self._met.constant("center", _center, lambda xyz: self.types.Vector(*xyz))
            normal = dr.select(self._met.kind(Sphere), self.configuration["sphere_normal"](point, center), normal)
        if Cube in kinds:
            if self.configuration.formula("cube_normal").facts.get("takes") == "ray":
                ray = self.ray if not self._placed else self.configuration["to_object"](self.ray, self._met.transform)
                cube = self.configuration["cube_normal"](ray, self.hit.distance)
            else:
                cube = self.configuration["cube_normal"](point)
            normal = dr.select(self._met.kind(Cube), cube, normal)
        if self.world.trees.forest is not None:
            triangles = self._met.kind(Mesh)
            normal = dr.select(triangles, self.world.trees.forest.normal(self.hit.number, triangles), normal)
        if self._placed:
            normal = self.configuration["world_normal"](normal, self._met.transform)
        return dr.select(self.mask, normal, 0)

    def _facing(self, normal: Any) -> Any:
        """Return the normals, those of two-sided shapes turned to the viewer: once, whichever shape was hit."""
        if not any(shape.two_sided for shape in self.shapes):
            return normal
        two_sided = self._met.constant("two-sided", lambda shape: shape.two_sided, self.types.Bool)
        return dr.select(two_sided, self.configuration["facing"](normal, self.ray.direction), normal)

    @cached_property
    def normal(self) -> Any:
        """Return the shading normals N, 0 where nothing was hit."""
        if self.world.plan.tables:
            return self._facing(self._looked_up_normal())
        each = (self._normal(index, shape) for index, shape in enumerate(self.shapes))
        return self._facing(self._met.choose(each, self.types.Vector(0)))

    @cached_property
    def hidden(self) -> Any:
        """Return where a one-sided surface shows its back."""
        one_sided = self._met.constant("one-sided", lambda shape: not shape.two_sided, self.types.Bool)
        return self.configuration["hidden"](self.normal, self.ray.direction) & one_sided

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Return all that light needs to know of them."""
        needed = (self.mask, self.position, self.normal)
        return (*needed, self.hidden, self.albedo) if self.shapes else needed

    @cached_property
    def albedo(self) -> Any:
        """Return the albedo per channel."""
        return self._met.constant("albedo", lambda shape: shape.albedo, lambda rgb: self.types.Vector(*rgb))

    @cached_property
    def clearance(self) -> Any:
        """Return how far along the normal the hit points may be off [m] (see `tracer.shapes.error_bounds`)."""
        wide: Any = 1.0
        if any(_spread(shape) != 1 for shape in self.shapes):
            wide = self._met.constant("spread", _spread, self.types.Float)
        if self.world.trees.forest is not None:
            kind = self._met.kind(Mesh)
            wide = dr.select(kind, self.world.trees.forest.slenderness(self.hit.number, kind), wide)
        size = self._met.constant("extent", extent, self.types.Float)
        scale = dr.norm(self.eye) + self.hit.distance + size
        return clearance(scale, spread=wide, precision=self.types.precision)
