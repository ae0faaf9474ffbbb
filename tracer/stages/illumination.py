"""Which lights reach the hit points, and how much light they bring."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr

from rayproof.cases.scene import Vector
from rayproof.tracer.device.scheduling import next_step
from rayproof.tracer.rays import Feeler, Hit, Interval, Ray
from rayproof.tracer.stages.feeler_origins import starting_points
from rayproof.tracer.stages.intersector import World
from rayproof.tracer.stages.light_loop import LightLoop
from rayproof.tracer.stages.surfaces import Surfaces

MANY = 6  # lights from which on a kernel loops over them; fewer are unrolled


@dataclass(frozen=True, kw_only=True)
class DirectionToLight:
    """The way from the hit points to one light."""

    light: Any  # m
    place: Vector | None  # the same on the host, None where the kernel reads it from memory [m]
    away: Any  # m, from the point to the light
    squared_distance: Any  # m^2
    distance: Any  # m
    cosine: Any  # dot(N, L); 0 for a light exactly at the point


class Illumination:
    """All lights of a scene as seen from the hits of a bundle of rays; every list has one entry per ray."""

    def __init__(self, world: World, surfaces: Sequence[Surfaces]) -> None:
        self.world, self.surfaces, self.types = world, surfaces, world.types
        self.scene, self.configuration = world.scene, world.configuration

    def _of_light(self, index: int, what: str, value: tuple[float, float, float]) -> Any:
        return self.world.parameters(f"light {index} {what}", self.types.Vector(*value))

    def _towards(self, position: Any, surfaces: Surfaces, place: Vector | None = None) -> DirectionToLight:
        away = position - surfaces.position
        squared = dr.squared_norm(away)
        cosine = self.configuration["cosine"](surfaces.normal, away)
        return DirectionToLight(
            light=position,
            place=place,
            away=away,
            squared_distance=squared,
            distance=dr.sqrt(squared),
            cosine=cosine,
        )

    @cached_property
    def towards(self) -> list[list[DirectionToLight]]:
        """Return, per light, the ways to it."""
        places = [light.position for light in self.scene.lights]
        positions = [self._of_light(k, "position", place) for k, place in enumerate(places)]
        return [
            [self._towards(position, surfaces, place) for surfaces in self.surfaces]
            for position, place in zip(positions, places, strict=True)
        ]

    @cached_property
    def _starting(self) -> tuple[World, list[Hit]]:
        return starting_points(self.world, self.surfaces)

    def _feeler(self, world: World, hit: Hit, towards: DirectionToLight, active: Any) -> Feeler:
        Float, Vector = world.types.Float, world.types.Vector
        start = self.configuration["feeler"](hit, Float(towards.cosine), Float(towards.distance))
        direction, end = self.configuration["segment"](start.origin, Vector(towards.light))
        width = dr.width(direction)
        if start.shorter:
            end = end * (1 - start.shorter)
        return Feeler(
            ray=Ray(origin=start.origin, direction=direction),
            interval=Interval(nearest=world.parameters.per_lane(Float(start.nearest), width), farthest=Float(end)),
            skip=start.skip,
            active=active,
        )

    def _above_horizon(self, towards: Sequence[DirectionToLight]) -> list[Any]:
        """Return where one light is above the horizon. A NaN cosine counts as above, so that it stays visible."""
        horizon = self.configuration["horizon"]
        return [one.mask & ~horizon(way.cosine) for one, way in zip(self.surfaces, towards, strict=True)]

    @cached_property
    def _above(self) -> list[list[Any]]:
        above = [self._above_horizon(towards) for towards in self.towards]
        # Then what follows is the same code for each light.
        self.world.parameters.store(above)
        return above

    def _unblocked(self, towards: Sequence[DirectionToLight], above: Sequence[Any]) -> list[Any]:
        """Return where nothing is in one light's way; below the horizon nobody asks."""
        masks = [surfaces.mask for surfaces in self.surfaces]
        if not self.world.has_blockers:
            return masks
        world, hits = self._starting
        feelers = [self._feeler(world, *one) for one in zip(hits, towards, above, strict=True)]
        world.parameters.store([feeler.arrays for feeler in feelers])
        next_step(self.types, samples=len(self.surfaces))
        blocked = world.blocked(feelers, world.types.Vector(towards[0].light), place=towards[0].place)
        free = [mask & ~there for mask, there in zip(masks, blocked, strict=True)]
        world.parameters.store(free)
        next_step(self.types, samples=len(self.surfaces))
        return free

    @cached_property
    def _free(self) -> list[list[Any]]:
        return [self._unblocked(*one) for one in zip(self.towards, self._above, strict=True)]

    def one(self, position: Any, flux: Any) -> tuple[list[Any], list[Any]]:
        """Return where one light at `position` [m] is seen, and the irradiance [W/m^2] that it brings there."""
        towards = [self._towards(position, surfaces) for surfaces in self.surfaces]
        above = self._above_horizon(towards)
        free = self._unblocked(towards, above)
        brought = [dr.select(f, self._brought(flux, way), 0) for f, way in zip(free, towards, strict=True)]
        return [a & f for a, f in zip(above, free, strict=True)], brought

    def settle(self) -> None:
        """Compute, before a loop, what does not depend on the light."""
        for surfaces in self.surfaces:
            _ = surfaces.mask, surfaces.normal
        if self.world.has_blockers:
            _ = self._starting

    @cached_property
    def _in_turn(self) -> LightLoop | None:
        # Only a sum can be taken two by two; another formula for it sees all lights at once.
        many = len(self.scene.lights) > MANY and self.configuration.formula("sum_lights").default
        return LightLoop(self) if many else None

    @cached_property
    def lit(self) -> list[list[Any]]:
        """Return, per light, where it is above the horizon and nothing is in its way."""
        if self._in_turn is not None:
            return self._in_turn.lit()
        return [
            [above & free for above, free in zip(*light, strict=True)]
            for light in zip(self._above, self._free, strict=True)
        ]

    def _brought(self, flux: Any, towards: DirectionToLight) -> Any:
        if self.scene.shading == "simplified":
            return self.configuration["simplified"](flux, towards.cosine)
        law = self.configuration.formula("falloff")
        facing = law.function(flux, getattr(towards, law.facts.get("by", "squared_distance")))
        return self.configuration["lambert"](facing, towards.cosine)

    @cached_property
    def irradiance(self) -> list[Any]:
        """Return E [W/m^2] per channel, 0 where nothing was hit."""
        if not self.scene.lights or not self.scene.shapes:
            return [self.types.Vector(0) for _ in self.surfaces]
        if self._in_turn is not None:
            return self._in_turn.irradiance
        fluxes = [self._of_light(k, "flux", light.flux) for k, light in enumerate(self.scene.lights)]
        total = []
        for k in range(len(self.surfaces)):
            # Below the horizon the cosine law itself gives 0; only what blocks is taken away here.
            contributions = [
                dr.select(free[k], self._brought(flux, towards[k]), 0)
                for flux, towards, free in zip(fluxes, self.towards, self._free, strict=True)
            ]
            total.append(self.configuration["sum_lights"](contributions))
        return total
