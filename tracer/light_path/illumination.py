"""The stages visibility and irradiance: shadow rays to each light, one by one or in a loop of the kernel.

Many lights are processed in a loop of the kernel, whose code does not grow with their number. Of a few lights, only
shadow rays through trees are in a loop.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Vector
from rayproof.tracer.kernel.arrays import next_step
from rayproof.tracer.light_path.shadow_stage import ShadowRayOrigins, shadow_ray_origins
from rayproof.tracer.light_path.surfaces import DeviceScene, SurfacePoint
from rayproof.tracer.rays import Hit, Interval, Ray, ShadowRay

MANY = 6  # the least number of lights for which a kernel loops over them; fewer are unrolled


@dataclass(frozen=True, kw_only=True)
class DirectionToLight:
    """The way from the hit points to one light."""

    light: Any  # m
    place: Vector | None  # the same on the host [m], None if the kernel reads it from memory
    away: Any  # m, from the point to the light
    squared_distance: Any  # m^2
    distance: Any  # m
    cosine: Any  # dot(N, L); 0 for a light exactly at the point


def _towards(
    world: DeviceScene, surfaces: Sequence[SurfacePoint], position: Any, place: Vector | None = None
) -> list[DirectionToLight]:
    """Return the ways to a light at `position` [m]."""
    directions = []
    for surface in surfaces:
        away = position - surface.position
        squared = dr.squared_norm(away)
        directions.append(
            DirectionToLight(
                light=position,
                place=place,
                away=away,
                squared_distance=squared,
                distance=dr.sqrt(squared),
                cosine=world.configuration["cosine"](surface.normal, away),
            )
        )
    return directions


def _above_horizon(
    world: DeviceScene, surfaces: Sequence[SurfacePoint], towards: Sequence[DirectionToLight]
) -> list[Any]:
    """Return the masks of hits with a light above the horizon. A NaN cosine counts as above, to stay visible."""
    horizon = world.configuration["horizon"]
    return [surface.met.mask & ~horizon(way.cosine) for surface, way in zip(surfaces, towards, strict=True)]


def _shadow_ray(world: DeviceScene, hit: Hit, towards: DirectionToLight, active: Any) -> ShadowRay:
    Float, Vector = world.types.Float, world.types.Vector
    start = world.configuration["shadow_ray"](hit, Float(towards.cosine), Float(towards.distance))
    direction, end = world.configuration["segment"](start.origin, Vector(towards.light))
    width = dr.width(direction)
    if start.shorter:
        end = end * (1 - start.shorter)
    return ShadowRay(
        ray=Ray(origin=start.origin, direction=direction),
        interval=Interval(nearest=world.parameters.per_lane(Float(start.nearest), width), farthest=Float(end)),
        skip=start.skip,
        active=active,
    )


def _unblocked(
    origins: ShadowRayOrigins | None,
    surfaces: Sequence[SurfacePoint],
    towards: Sequence[DirectionToLight],
    above: Sequence[Any],
) -> list[Any]:
    """Return the mask of unblocked points per light; points below the light's horizon are not tested."""
    masks = [surface.met.mask for surface in surfaces]
    if origins is None:
        return masks
    world = origins.world
    shadow_rays = [_shadow_ray(world, *inputs) for inputs in zip(origins.hits, towards, above, strict=True)]
    world.parameters.store([shadow_ray.arrays for shadow_ray in shadow_rays])
    next_step(world.types, samples=len(surfaces))
    blocked = world.blocked(shadow_rays, world.types.Vector(towards[0].light), place=towards[0].place)
    free = [mask & ~there for mask, there in zip(masks, blocked, strict=True)]
    world.parameters.store(free)
    next_step(world.types, samples=len(surfaces))
    return free


def _alike(world: DeviceScene) -> bool:
    """Return whether the shadow rays to all lights run through the same code: only trees, in a kernel of their own."""
    return world.in_trees and not world.bodies.each and not world.parameters.shared


def _unblocked_by_loop(origins: ShadowRayOrigins, surfaces: Sequence[SurfacePoint]) -> list[list[Any]]:
    """Return the masks of `_unblocked`, computed in a loop over the lights: each light is a bit of a ray's number."""
    world, lights = origins.world, origins.world.scene.lights
    UInt, width = world.types.UInt, dr.width(surfaces[0].met.hit.distance)
    positions = _numbers(world, "positions", [light.position for light in lights])

    def step(index: Any, free: Any) -> tuple[Any, Any]:
        towards = _towards(world, surfaces, dr.gather(world.types.Vector, positions, index))
        unblocked = _unblocked(origins, surfaces, towards, _above_horizon(world, surfaces, towards))
        return index + 1, [
            bits | dr.select(mask, UInt(1) << index, 0) for bits, mask in zip(free, unblocked, strict=True)
        ]

    _, free = dr.while_loop(
        state=(dr.zeros(UInt, width), [dr.zeros(UInt, width) for _ in surfaces]),
        cond=lambda index, free: index < len(lights),
        body=step,
        labels=("index", "free"),
    )
    return [[(bits >> light) & 1 != 0 for bits in free] for light in range(len(lights))]


def _brought(world: DeviceScene, flux: Any, towards: DirectionToLight) -> Any:
    """Return the irradiance [W/m^2] by an unblocked light; 0 below the horizon."""
    if world.scene.shading == "simplified":
        return world.configuration["simplified"](flux, towards.cosine)
    law = world.configuration.formula("falloff")
    facing = law.function(flux, getattr(towards, law.facts.get("by", "squared_distance")))
    return world.configuration["lambert"](facing, towards.cosine)


def _of_light(world: DeviceScene, index: int, what: str, value: Vector) -> Any:
    return world.parameters(f"light {index} {what}", world.types.Vector(*value))


def illuminate(
    world: DeviceScene, surfaces: Sequence[SurfacePoint], *, visibility: bool, known: Sequence[list[Any]] | None = None
) -> tuple[list[list[Any]], list[Any]]:
    """Return the visibility of each light, per light and ray, and the irradiance E [W/m^2], 0 on a miss.

    The scene must have lights and shapes. Without `visibility` the first may be missing. A `known` visibility is not
    computed again.
    """
    if known is not None:
        return _unrolled(world, surfaces, known)
    # In a loop, lights are added one by one; a formula other than the default sum needs all lights at once.
    if len(world.scene.lights) > MANY and world.configuration.formula("sum_lights").default:
        return _by_loop(world, surfaces, visibility=visibility)
    return _unrolled(world, surfaces)


def _by_loop(
    world: DeviceScene, surfaces: Sequence[SurfacePoint], *, visibility: bool
) -> tuple[list[list[Any]], list[Any]]:
    # Before the loop: it does not depend on the light.
    origins = shadow_ray_origins(world, surfaces) if world.has_blockers else None

    def one_light(position: Any, flux: Any) -> tuple[list[Any], list[Any]]:
        towards = _towards(world, surfaces, position)
        above = _above_horizon(world, surfaces, towards)
        free = _unblocked(origins, surfaces, towards, above)
        brought = [dr.select(f, _brought(world, flux, way), 0) for f, way in zip(free, towards, strict=True)]
        return [a & f for a, f in zip(above, free, strict=True)], brought

    return light_loop(world, surfaces, one_light, visibility=visibility)


def _unrolled(
    world: DeviceScene, surfaces: Sequence[SurfacePoint], visible: Sequence[list[Any]] | None = None
) -> tuple[list[list[Any]], list[Any]]:
    lights = world.scene.lights
    positions = [_of_light(world, k, "position", light.position) for k, light in enumerate(lights)]
    towards = [
        _towards(world, surfaces, position, light.position) for position, light in zip(positions, lights, strict=True)
    ]
    above = [_above_horizon(world, surfaces, ways) for ways in towards]
    # With the masks in memory, the rest is the same code for each light.
    world.parameters.store(above)
    if visible is None:
        origins = shadow_ray_origins(world, surfaces) if world.has_blockers else None
        if origins is not None and len(lights) > 1 and _alike(world):
            free = _unblocked_by_loop(origins, surfaces)
        else:
            free = [_unblocked(origins, surfaces, *pair) for pair in zip(towards, above, strict=True)]
    else:
        free = visible
    lit = [[a & f for a, f in zip(*pair, strict=True)] for pair in zip(above, free, strict=True)]
    fluxes = [_of_light(world, k, "flux", light.flux) for k, light in enumerate(lights)]
    irradiance = []
    for k in range(len(surfaces)):
        # Below the horizon the cosine law itself gives 0; only blocked light is removed here.
        brought = [
            dr.select(unblocked[k], _brought(world, flux, ways[k]), 0)
            for flux, ways, unblocked in zip(fluxes, towards, free, strict=True)
        ]
        irradiance.append(world.configuration["sum_lights"](brought))
    return lit, irradiance


# (position [m], flux [W]) of a light -> its visibility and its irradiance [W/m^2], per ray.
OneLight = Callable[[Any, Any], tuple[list[Any], list[Any]]]


def _numbers(world: DeviceScene, name: str, values: list[tuple[float, float, float]]) -> Any:
    return world.buffers.floats(f"lights' {name}", world.types, lambda: np.array(values))


def _loop(world: DeviceScene, surfaces: Sequence[SurfacePoint], one_light: OneLight, visible: Any) -> list[Any]:
    """Return the irradiance [W/m^2] per ray; write 1 into `visible`, unless it is None, for each visible light."""
    types, lights = world.types, world.scene.lights
    rays, width = len(surfaces), dr.width(surfaces[0].met.hit.distance)
    positions = _numbers(world, "positions", [light.position for light in lights])
    fluxes = _numbers(world, "fluxes", [light.flux for light in lights])
    lane = dr.arange(types.UInt, width)
    add = world.configuration["sum_lights"]

    def step(index: Any, total: Any) -> tuple[Any, Any]:
        position, flux = (dr.gather(types.Vector, numbers, index) for numbers in (positions, fluxes))
        lit, brought = one_light(position, flux)
        if visible is not None:
            for k, mask in enumerate(lit):
                where = (index * rays + k) * width + lane
                dr.scatter(visible, dr.select(mask, types.Float(1), 0), where, mode=dr.ReduceMode.Permute)
        return index + 1, [add(list(pair)) for pair in zip(total, brought, strict=True)]

    _, total = dr.while_loop(
        state=(dr.zeros(types.UInt, width), [dr.zeros(types.Vector, width) for _ in range(rays)]),
        cond=lambda index, total: index < len(lights),
        body=step,
        labels=("index", "total"),
    )
    return list(total)


def light_loop(
    world: DeviceScene, surfaces: Sequence[SurfacePoint], one_light: OneLight, *, visibility: bool
) -> tuple[list[list[Any]], list[Any]]:
    """Return the mask of visibility per light and ray, and E [W/m^2] per ray, both from one loop over the lights.

    With `visibility` the loop is evaluated here; without it, the list of masks is empty.
    """
    if not visibility:
        return [], _loop(world, surfaces, one_light, None)
    lights, rays, width = len(world.scene.lights), len(surfaces), dr.width(surfaces[0].met.hit.distance)
    flags = dr.zeros(world.types.Float, lights * rays * width)
    irradiance = _loop(world, surfaces, one_light, flags)
    dr.eval(flags, irradiance)
    visible = np.array(flags).reshape(lights, rays, width) > 0
    return [[world.types.Bool(ray) for ray in light] for light in visible], irradiance
