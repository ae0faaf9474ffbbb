"""The start of shadow rays by a strategy against shadow acne, and the distance within which it misses blockers.

A strategy may compute the start and the intersections of shadow rays in float64. Its price is a shadow epsilon:
blockers nearer to the surface than that may be missed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr

from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.light_path.surfaces import DeviceScene, HitShapes, SurfacePoint, clearance, hit_point
from rayproof.tracer.rays import Hit, Interval, Ray
from rayproof.tracer.shapes.bounds import bound

WINDOW = 2.0**-10  # relative to t: the half-width of the interval in which the visible shape is hit again


@dataclass(frozen=True, kw_only=True)
class ShadowRayOrigins:
    """The hits that shadow rays start from, one for each ray, and the world that they run through."""

    world: DeviceScene
    hits: list[Hit]


def shadow_ray_origins(world: DeviceScene, surfaces: Sequence[SurfacePoint]) -> ShadowRayOrigins:
    """Return the origins of the shadow rays."""
    if world.configuration.formula("shadow_ray").facts.get("doubles", False) and world.types.precision != "float64":
        return _in_float64(world, surfaces)
    hits = [
        Hit(
            position=surface.position,
            normal=surface.normal,
            shape=surface.met.hit.shape,
            clearance=clearance(surface.met),
            ray=surface.met.ray,
            distance=surface.met.hit.distance,
        )
        for surface in surfaces
    ]
    world.parameters.store([hit.clearance for hit in hits])
    return ShadowRayOrigins(world=world, hits=hits)


def _in_float64(world: DeviceScene, surfaces: Sequence[SurfacePoint]) -> ShadowRayOrigins:
    """Return the hits of the same rays recomputed in float64, or the original hits where that fails."""
    types, parameters = array_types("float64"), world.parameters
    wide = DeviceScene(replace(world.context, types=types))
    rays, intervals = [], []
    for surface in surfaces:
        # The visible shape is hit again by the same ray; the window excludes other shapes.
        t, ray = types.Float(surface.met.hit.distance), surface.met.ray
        window = t * WINDOW
        rays.append(Ray(origin=types.Vector(ray.origin), direction=types.Vector(ray.direction)))
        intervals.append(Interval(nearest=t - window, farthest=t + window))
    parameters.store([(ray.origin, ray.direction) for ray in rays])
    parameters.store([(interval.nearest, interval.farthest) for interval in intervals])
    hits = []
    for surface, ray, hit in zip(surfaces, rays, wide.nearest(rays, intervals), strict=True):
        again = HitShapes(world=wide, ray=ray, hit=hit, mask=hit.distance < dr.inf)
        usual = surface.met
        hits.append(
            Hit(
                position=dr.select(again.mask, hit_point(again), types.Vector(surface.position)),
                normal=types.Vector(surface.normal),
                shape=usual.hit.shape,
                clearance=dr.select(again.mask, clearance(again), types.Float(clearance(usual))),
                ray=ray,
                distance=dr.select(again.mask, hit.distance, types.Float(usual.hit.distance)),
            )
        )
    parameters.store([(hit.position, hit.normal, hit.clearance, hit.distance) for hit in hits])
    return ShadowRayOrigins(world=wide, hits=hits)


def shadow_epsilon(configuration: Configuration, *, scale: Any, spread: Any = 1.0) -> Any:
    """Return the distance from a surface [m] within which the configuration's strategy may miss blockers.

    `scale` is the largest absolute coordinate of the scene [m]; `spread` is the largest of its shapes'
    `TracedShape.spreads`; both may be arrays. This is a bound for the whole image; the strategies use the smaller
    clearance of each pixel.
    """
    strategy = configuration.formula("shadow_ray")
    precision = "float64" if strategy.facts.get("doubles", False) else configuration.precision
    epsilon = strategy.facts.get("clearances", 1) * bound(scale=scale, spread=spread, precision=precision)
    moved = strategy.facts.get("moved")
    return epsilon if moved is None else epsilon + moved(scale, precision)
