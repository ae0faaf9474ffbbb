"""Where feelers start, and the shapes that they run through, in the precision that the strategy wants."""

from collections.abc import Sequence
from dataclasses import replace

import drjit as dr

from rayproof.tracer.device.arrays import array_types
from rayproof.tracer.rays import Hit, Interval, Ray
from rayproof.tracer.stages.intersector import World
from rayproof.tracer.stages.surfaces import Surfaces

WINDOW = 2.0**-10  # of t, on either side: where the shape that a pixel shows is met again


def _hit(surfaces: Surfaces) -> Hit:
    return Hit(
        position=surfaces.position,
        normal=surfaces.normal,
        shape=surfaces.hit.shape,
        clearance=surfaces.clearance,
        ray=surfaces.ray,
        distance=surfaces.hit.distance,
    )


def starting_points(world: World, surfaces: Sequence[Surfaces]) -> tuple[World, list[Hit]]:
    """Return the world that feelers run through and the hits that they start from, one for each ray."""
    if not world.configuration.formula("feeler").facts["doubles"] or world.types.precision == "float64":
        hits = [_hit(one) for one in surfaces]
        world.parameters.store([hit.clearance for hit in hits])
        return world, hits
    return _in_float64(world, surfaces)


def _in_float64(world: World, surfaces: Sequence[Surfaces]) -> tuple[World, list[Hit]]:
    """Return the hits of the same rays, found again; where that fails, the usual ones."""
    types, parameters = array_types("float64"), world.parameters
    wide = World(replace(world.context, types=types))
    rays, intervals = [], []
    for one in surfaces:
        # The shape that the pixel shows is met again along the same ray; the window leaves the others out.
        t = types.Float(one.hit.distance)
        window = t * WINDOW
        rays.append(Ray(origin=types.Vector(one.ray.origin), direction=types.Vector(one.ray.direction)))
        intervals.append(Interval(nearest=t - window, farthest=t + window))
    parameters.store([(ray.origin, ray.direction) for ray in rays])
    parameters.store([(interval.nearest, interval.farthest) for interval in intervals])
    hits = []
    for one, ray, hit in zip(surfaces, rays, wide.nearest(rays, intervals), strict=True):
        exact = Surfaces(wide, ray, hit, eye=ray.origin)
        hits.append(
            Hit(
                position=dr.select(exact.mask, exact.position, types.Vector(one.position)),
                normal=types.Vector(one.normal),
                shape=one.hit.shape,
                clearance=dr.select(exact.mask, exact.clearance, types.Float(one.clearance)),
                ray=ray,
                distance=dr.select(exact.mask, hit.distance, types.Float(one.hit.distance)),
            )
        )
    parameters.store([(hit.position, hit.normal, hit.clearance, hit.distance) for hit in hits])
    return wide, hits
