"""Where feelers start, and the shapes that they run through, in the precision that the strategy wants."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import drjit as dr

from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.rays import Hit, Interval, Ray
from rayproof.tracer.stages.hit_attributes import HitShapes
from rayproof.tracer.stages.intersector import World
from rayproof.tracer.stages.surfaces import Surface, clearance, hit_point

WINDOW = 2.0**-10  # of t, on either side: where the shape that a pixel shows is met again


@dataclass(frozen=True, kw_only=True)
class FeelerOrigins:
    """The hits that feelers start from, one for each ray, and the world that they run through."""

    world: World
    hits: list[Hit]


def feeler_origins(world: World, surfaces: Sequence[Surface]) -> FeelerOrigins | None:
    """Return where feelers start, or None where nothing can stand in a light's way."""
    if not world.has_blockers:
        return None
    if world.configuration.formula("feeler").facts.get("doubles", False) and world.types.precision != "float64":
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
    return FeelerOrigins(world=world, hits=hits)


def _in_float64(world: World, surfaces: Sequence[Surface]) -> FeelerOrigins:
    """Return the hits of the same rays, found again; where that fails, the usual ones."""
    types, parameters = array_types("float64"), world.parameters
    wide = World(replace(world.context, types=types))
    rays, intervals = [], []
    for surface in surfaces:
        # The shape that the pixel shows is met again along the same ray; the window leaves the others out.
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
    return FeelerOrigins(world=wide, hits=hits)
