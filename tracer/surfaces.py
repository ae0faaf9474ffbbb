"""What depends on which shape was hit: chosen per pixel among the shapes, or looked up where there are many."""

import hashlib
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import drjit as dr
import numpy as np

from cases.scene import Cube, Mesh, Shape, Sphere, Triangle
from tracer.clearance import clearance, extent, spread
from tracer.gathered import GatheredPlacement
from tracer.placement import Placement
from tracer.rays import Nearest, Ray
from tracer.world import World, flat_normal

Value = TypeVar("Value", bound=Hashable)


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
    return (0.0, 0.0, 1.0) if isinstance(shape, Sphere | Cube | Mesh) else flat_normal(shape)


class Surfaces:
    """The surfaces at the nearest hits of one bundle of rays."""

    def __init__(self, world: World, ray: Ray, hit: Nearest, *, eye: Any) -> None:
        self.world, self.ray, self.hit, self.eye = world, ray, hit, eye
        self.shapes, self.types = world.scene.shapes, world.types
        self.configuration = world.configuration

    @cached_property
    def mask(self) -> Any:
        """Return which rays hit anything."""
        return self.hit.distance < dr.inf

    def _shows(self, index: int) -> Any:
        """Return which pixels show a shape."""
        return self.hit.shape == self.world.parameter(index, "number", self.types.Int(index))

    def _choose(self, values: Iterable[Any], otherwise: Any) -> Any:
        """Return, per pixel, the value of the shape that was hit."""
        parameters = self.world.parameters
        chosen = parameters.per_lane(otherwise, dr.width(self.hit.shape))
        for index, value in enumerate(values):
            chosen = dr.select(self._shows(index), value, chosen)
            parameters.store(chosen)
        return chosen

    def constant(self, name: str, of: Callable[[Shape], Value], upload: Callable[[Value], Any]) -> Any:
        """Return a constant of the shape that was hit, without any choice where all shapes share it."""
        values = [of(shape) for shape in self.shapes]
        if self.world.parameters.shared:
            # Where nothing was hit, the last one's, as below.
            return self._look_up([values[-1], *values], upload(values[0]), first=-1)
        if len(set(values)) == 1:
            return self.world.parameter(0, f"constant {name}", upload(values[0]))
        if self.world.plan.tables:
            return self._look_up(values, upload(values[0]))
        named = enumerate(values)
        *others, last = (self.world.parameter(index, f"constant {name}", upload(value)) for index, value in named)
        return self._choose(others, last)

    def _look_up(self, values: Sequence[Any], like: Any, *, first: int = 0) -> Any:
        """Return, per pixel, the value of the shape that was hit, from a table; `like` has the type of one.

        The table begins with the shape `first`, -1 for pixels that show none.
        """
        table = np.asarray(values, dtype=np.float64)
        # Named by what is in it: the same table has the same name in every trace of a scene.
        name = hashlib.sha256(table.tobytes()).hexdigest()[:16]
        numbers = self.world.assets.floats(f"table {name}", self.types, lambda: table)
        found = self.hit.shape >= first
        kind = self.types.Float if dr.is_mask_v(like) else type(like)
        value = dr.gather(kind, numbers, self.types.UInt(self.hit.shape - first), found)
        return value > 0 if dr.is_mask_v(like) else value

    @cached_property
    def placement(self) -> GatheredPlacement:
        """Return the model matrix of the shape that was hit, from tables."""
        placements = [Placement(to_world=shape.to_world) for shape in self.shapes]
        Vector = self.types.Vector
        rows = [self._look_up([p.inverse[k] for p in placements], Vector(0)) for k in range(3)]
        columns = [self._look_up([p.linear[:, k] for p in placements], Vector(0)) for k in range(3)]
        translation = self._look_up([p.translation for p in placements], Vector(0))
        return GatheredPlacement(rows=rows, columns=columns, translation=translation)

    @cached_property
    def _placed(self) -> bool:
        return any(not Placement(to_world=shape.to_world).identity for shape in self.shapes)

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
            return to_object(self.ray, self.placement), self.placement.point_to_world
        placements = self.world.placements
        rays = [self.ray if p.identity else to_object(self.ray, p) for p in placements]
        local = Ray(
            origin=self._choose([ray.origin for ray in rays], self.ray.origin),
            direction=self._choose([ray.direction for ray in rays], self.ray.direction),
        )

        def to_world(point: Any) -> Any:
            return self._choose([point if p.identity else p.point_to_world(point) for p in placements], point)

        return local, to_world

    def spheres(self) -> tuple[Any, Any, Any]:
        """Return where a sphere was hit, and its centre and radius [m]."""
        return (
            self.constant("is a sphere", lambda shape: isinstance(shape, Sphere), self.types.Bool) & self.mask,
            self.constant("center", _center, lambda center: self.types.Vector(*center)),
            self.constant("radius", lambda shape: shape.radius if isinstance(shape, Sphere) else 1.0, self.types.Float),
        )

    def _object_normal(self, index: int, shape: Shape, placement: Placement) -> Any:
        match shape:
            case Cube() if self.configuration.formula("cube_normal").facts.get("takes") == "ray":
                ray = self.ray if placement.identity else self.configuration["to_object"](self.ray, placement)
                return self.configuration["cube_normal"](ray, self.hit.distance)
            case Sphere() | Cube():
                point = self.position if placement.identity else placement.point_to_object(self.position)
                if isinstance(shape, Cube):
                    return self.configuration["cube_normal"](point)
                center = self.world.parameter(index, "center", self.types.Vector(*shape.center))
                return self.configuration["sphere_normal"](point, center)
            case Mesh():
                if self.world.forest is None:
                    return self.types.Vector(0)
                return self.world.forest.normal(self.hit.number, self._shows(index))
            case Triangle():
                return self.world.parameter(index, "normal", self.types.Vector(*flat_normal(shape)))
            case _:
                return self.types.Vector(*flat_normal(shape))

    def _normal(self, index: int, shape: Shape) -> Any:
        placement = self.world.placements[index]
        normal = self._object_normal(index, shape, placement)
        if not placement.identity:
            normal = self.configuration["world_normal"](normal, placement)
        return normal

    def _kind(self, *kinds: type[Shape]) -> Any:
        """Return where a shape of one of these kinds was hit."""
        return self.constant("kind", lambda shape: isinstance(shape, kinds), self.types.Bool) & self.mask

    def _looked_up_normal(self) -> Any:
        """Return the shading normals: every kind's formula once, and the matrices from tables."""
        kinds = {type(shape) for shape in self.shapes}
        point = self.position if not self._placed else self.placement.point_to_object(self.position)
        normal = self.constant("normal", _constant_normal, lambda xyz: self.types.Vector(*xyz))
        if Sphere in kinds:
            center = self.constant("center", _center, lambda xyz: self.types.Vector(*xyz))
            normal = dr.select(self._kind(Sphere), self.configuration["sphere_normal"](point, center), normal)
        if Cube in kinds:
            if self.configuration.formula("cube_normal").facts.get("takes") == "ray":
                ray = self.ray if not self._placed else self.configuration["to_object"](self.ray, self.placement)
                cube = self.configuration["cube_normal"](ray, self.hit.distance)
            else:
                cube = self.configuration["cube_normal"](point)
            normal = dr.select(self._kind(Cube), cube, normal)
        if self.world.forest is not None:
            triangles = self._kind(Mesh)
            normal = dr.select(triangles, self.world.forest.normal(self.hit.number, triangles), normal)
        if self._placed:
            normal = self.configuration["world_normal"](normal, self.placement)
        return dr.select(self.mask, normal, 0)

    def _facing(self, normal: Any) -> Any:
        """Return the normals, those of two-sided shapes turned to the viewer: once, whichever shape was hit."""
        if not any(shape.two_sided for shape in self.shapes):
            return normal
        two_sided = self.constant("two-sided", lambda shape: shape.two_sided, self.types.Bool)
        return dr.select(two_sided, self.configuration["facing"](normal, self.ray.direction), normal)

    @cached_property
    def normal(self) -> Any:
        """Return the shading normals N, 0 where nothing was hit."""
        if self.world.plan.tables:
            return self._facing(self._looked_up_normal())
        each = (self._normal(index, shape) for index, shape in enumerate(self.shapes))
        return self._facing(self._choose(each, self.types.Vector(0)))

    @cached_property
    def hidden(self) -> Any:
        """Return where a one-sided surface shows its back."""
        one_sided = self.constant("one-sided", lambda shape: not shape.two_sided, self.types.Bool)
        return self.configuration["hidden"](self.normal, self.ray.direction) & one_sided

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Return all that light needs to know of them."""
        needed = (self.mask, self.position, self.normal)
        return (*needed, self.hidden, self.albedo) if self.shapes else needed

    @cached_property
    def albedo(self) -> Any:
        """Return the albedo per channel."""
        return self.constant("albedo", lambda shape: shape.albedo, lambda rgb: self.types.Vector(*rgb))

    @cached_property
    def clearance(self) -> Any:
        """Return how far along the normal the hit points may be off [m] (see `tracer.clearance`)."""
        wide: Any = 1.0
        if any(_spread(shape) != 1 for shape in self.shapes):
            wide = self.constant("spread", _spread, self.types.Float)
        if self.world.forest is not None:
            kind = self._kind(Mesh)
            wide = dr.select(kind, self.world.forest.slenderness(self.hit.number, kind), wide)
        size = self.constant("extent", extent, self.types.Float)
        scale = dr.norm(self.eye) + self.hit.distance + size
        return clearance(scale, spread=wide, precision=self.types.precision)
