"""Rays one by one through Mitsuba's scalar variant, in which no compiler takes part."""

from typing import Any

import numpy as np

from cases.scene import Camera, PointLight
from reference.mitsuba3.tracing import Feelers, Hits, Interval, pixel_centers
from reference.mitsuba3.worlds import World

NOWHERE = (0.0, 0.0, 0.0)


def trace(world: World, camera: Camera, interval: Interval | None) -> Hits:
    """Return what the rays through the pixel centres hit."""
    mi, scene, sensor = world.mi, world.loaded, world.sensor
    centers = pixel_centers(camera)
    count = len(centers)
    # Coordinate after coordinate: lists take vectors faster than rows of arrays do.
    direction, position, normal = [], [], []
    shape, primitive = np.full(count, -1), np.zeros(count, dtype=int)
    interactions = []
    unused = mi.Point2f(0.5, 0.5)
    for number, (x, y) in enumerate(centers.tolist()):
        ray, _ = sensor.sample_ray(0.0, 0.0, mi.Point2f(x, y), unused)
        direction.extend(ray.d)
        if interval is not None:
            origin = mi.Point3f(*camera.eye) + interval.start * ray.d
            ray = mi.Ray3f(origin, ray.d, interval.end - interval.start, 0.0, ray.wavelengths)
        hit = scene.ray_intersect(ray)
        interactions.append(hit)
        if hit.is_valid():
            shape[number] = world.indices[hit.shape if hit.instance is None else hit.instance]
            primitive[number] = hit.prim_index
            position.extend(hit.p)
            normal.extend(hit.n)
        else:
            position.extend(NOWHERE)
            normal.extend(NOWHERE)
    return Hits(
        direction=np.array(direction).reshape(-1, 3),
        shape=shape,
        primitive=primitive,
        position=np.array(position).reshape(-1, 3),
        normal=np.array(normal).reshape(-1, 3),
        interactions=interactions,
    )


def feel(world: World, hits: Hits, light: PointLight, asked: np.ndarray) -> Feelers:
    """Return what arrives from `light` at the hits that are `asked` about, (n,) bool."""
    mi, scene = world.mi, world.loaded
    world.place(light)
    emitter, target, unused = world.emitter, mi.Point3f(*light.position), mi.Point2f(0.5, 0.5)
    free, arriving = np.zeros(len(asked), dtype=bool), np.zeros((len(asked), 3))
    for number in np.flatnonzero(asked).tolist():
        hit = hits.interactions[number]
        free[number] = not scene.ray_test(hit.spawn_ray_to(target))
        arriving[number] = tuple(emitter.sample_direction(hit, unused)[1])
    return Feelers(free=free, arriving=arriving)


def ends(world: World, film: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where the rays through points of the film (n, 2) start and where they end [m], (n, 3) each."""
    mi, unused = world.mi, world.mi.Point2f(0.5, 0.5)
    rays = [world.sensor.sample_ray(0.0, 0.0, mi.Point2f(x, y), unused)[0] for x, y in film.tolist()]
    return np.array([tuple(ray.o) for ray in rays]), np.array([tuple(ray(ray.maxt)) for ray in rays])


def integrator(world: World) -> Any:
    """Return the scene's own."""
    return world.loaded.integrator()
