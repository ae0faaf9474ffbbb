"""Which lights reach the hit points, and how much light they bring."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr

from cases.scene import PointLight
from tracer.arrays import array_types
from tracer.feeling import Hit
from tracer.rays import Interval, Ray
from tracer.surfaces import Surfaces
from tracer.world import World


@dataclass(frozen=True, kw_only=True)
class Towards:
    """The way from the hit points to one light."""

    light: Any  # m
    away: Any  # m, from the point to the light
    squared_distance: Any  # m^2
    distance: Any  # m
    cosine: Any  # dot(N, L); 0 for a light exactly at the point


class Illumination:
    """All lights of a scene as seen from one bundle of hit points."""

    def __init__(self, surfaces: Surfaces) -> None:
        self.surfaces = surfaces
        self.world, self.types = surfaces.world, surfaces.types
        self.scene, self.configuration = surfaces.world.scene, surfaces.world.configuration

    def _towards(self, light: PointLight) -> Towards:
        position = self.types.Vector(*light.position)
        away = position - self.surfaces.position
        squared = dr.squared_norm(away)
        cosine = self.configuration["cosine"](self.surfaces.normal, away)
        return Towards(light=position, away=away, squared_distance=squared, distance=dr.sqrt(squared), cosine=cosine)

    @cached_property
    def towards(self) -> tuple[Towards, ...]:
        """Return the way to each light."""
        return tuple(self._towards(light) for light in self.scene.lights)

    @cached_property
    def _feeling(self) -> tuple[World, Hit]:
        """Return the world that feelers run through and the points that they start from, in their precision."""
        surfaces = self.surfaces
        if not self.configuration.formula("feeler").facts["doubles"] or self.types.precision == "float64":
            hit = Hit(
                position=surfaces.position,
                normal=surfaces.normal,
                shape=surfaces.hit.shape,
                clearance=surfaces.clearance,
                ray=surfaces.ray,
                distance=surfaces.hit.distance,
            )
            return self.world, hit
        types = array_types("float64")
        world = World(self.scene, self.configuration, types)
        ray = Ray(origin=types.Vector(surfaces.ray.origin), direction=types.Vector(surfaces.ray.direction))
        # The shape that the pixel shows is met again along the same ray; `around` leaves the others out.
        t = types.Float(surfaces.hit.distance)
        window = t * 2.0**-10
        exact = Surfaces(
            world, ray, world.nearest(ray, Interval(nearest=t - window, farthest=t + window)), eye=ray.origin
        )
        hit = Hit(
            position=dr.select(exact.mask, exact.position, types.Vector(surfaces.position)),
            normal=types.Vector(surfaces.normal),
            shape=surfaces.hit.shape,
            clearance=dr.select(exact.mask, exact.clearance, types.Float(surfaces.clearance)),
            ray=ray,
            distance=dr.select(exact.mask, exact.hit.distance, t),
        )
        return world, hit

    def _blocked(self, towards: Towards, active: Any) -> Any:
        world, hit = self._feeling
        Float, Vector = world.types.Float, world.types.Vector
        start = self.configuration["feeler"](hit, Float(towards.cosine), Float(towards.distance))
        direction, end = self.configuration["segment"](start.origin, Vector(towards.light))
        if start.shorter:
            end = end * (1 - start.shorter)
        ray = Ray(origin=start.origin, direction=direction)
        interval = Interval(nearest=Float(start.nearest), farthest=Float(end))
        return world.blocked(ray, interval, skip=start.skip, active=active)

    @cached_property
    def _above(self) -> tuple[Any, ...]:
        """Return, per light, where it is above the horizon. A NaN cosine counts as above, so that it stays visible."""
        horizon = self.configuration["horizon"]
        return tuple(self.surfaces.mask & ~horizon(towards.cosine) for towards in self.towards)

    @cached_property
    def _free(self) -> tuple[Any, ...]:
        """Return, per light, where nothing is in its way; below the horizon nobody asks."""
        if not self.world.has_blockers:
            return tuple(self.surfaces.mask for _ in self.towards)
        return tuple(
            self.surfaces.mask & ~self._blocked(towards, above)
            for towards, above in zip(self.towards, self._above, strict=True)
        )

    @cached_property
    def lit(self) -> tuple[Any, ...]:
        """Return, per light, where it is above the horizon and nothing is in its way."""
        return tuple(above & free for above, free in zip(self._above, self._free, strict=True))

    @cached_property
    def irradiance(self) -> Any:
        """Return E [W/m^2] per channel, 0 where nothing was hit."""
        Vector = self.types.Vector
        if not self.scene.lights or not self.scene.shapes:
            return Vector(0)
        contributions = []
        for light, towards, free in zip(self.scene.lights, self.towards, self._free, strict=True):
            flux = Vector(*light.flux)
            if self.scene.shading == "simplified":
                brought = self.configuration["simplified"](flux, towards.cosine)
            else:
                law = self.configuration.formula("falloff")
                facing = law.function(flux, getattr(towards, law.facts.get("by", "squared_distance")))
                brought = self.configuration["lambert"](facing, towards.cosine)
            # Below the horizon the cosine law itself gives 0; only what blocks is taken away here.
            contributions.append(dr.select(free, brought, 0))
        return self.configuration["sum_lights"](contributions)
