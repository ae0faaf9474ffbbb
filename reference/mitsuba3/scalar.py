"""Rays one by one through Mitsuba's scalar variant, in which no compiler takes part."""

from typing import Any

import numpy as np

from rayproof.cases.scene import Camera, PointLight
from rayproof.reference.mitsuba3.tracing import Feelers, Hits, Interval, pixel_centers
from rayproof.reference.mitsuba3.worlds import World


def trace(world: World, camera: Camera, interval: Interval | None) -> Hits:
    """Return what the rays through the pixel centres hit."""
    mi, indices = world.mi, world.indices
    # Looked up once and not for every ray, as are numbers put into lists: rows of arrays take them more slowly.
    sample, intersect, point = world.sensor.sample_ray, world.loaded.ray_intersect, mi.Point2f
    unused, eye = point(0.5, 0.5), mi.Point3f(*camera.eye)
    directions: list[float] = []
    hit_by: list[int] = []
    shapes: list[int] = []
    primitives: list[int] = []
    places: list[float] = []
    interactions: list[Any] = []
    centers = pixel_centers(camera).tolist()
    for number, (x, y) in enumerate(centers):
        ray = sample(0.0, 0.0, point(x, y), unused)[0]
        direction = ray.d
        directions += direction[0], direction[1], direction[2]
        if interval is not None:
            origin = eye + interval.start * direction
            ray = mi.Ray3f(origin, direction, interval.end - interval.start, 0.0, ray.wavelengths)
        hit = intersect(ray)
        if hit.is_valid():
            instance, p, n = hit.instance, hit.p, hit.n
            hit_by.append(number)
            shapes.append(indices[hit.shape if instance is None else instance])
            primitives.append(hit.prim_index)
            places += p[0], p[1], p[2], n[0], n[1], n[2]
            interactions.append(hit)
    shape, primitive = np.full(len(centers), -1), np.zeros(len(centers), dtype=int)
    position, normal = np.zeros((len(centers), 3)), np.zeros((len(centers), 3))
    shape[hit_by], primitive[hit_by] = shapes, primitives
    position[hit_by], normal[hit_by] = np.array(places).reshape(-1, 2, 3).swapaxes(0, 1)
    return Hits(
        direction=np.array(directions).reshape(-1, 3),
        shape=shape,
        primitive=primitive,
        position=position,
        normal=normal,
        interactions=dict(zip(hit_by, interactions, strict=True)),
    )


def feel(world: World, hits: Hits, light: PointLight, asked: np.ndarray) -> Feelers:
    """Return what arrives from `light` at the hits that are `asked` about, (n,) bool."""
    mi = world.mi
    world.place(light)
    blocked, emitted = world.loaded.ray_test, world.emitter.sample_direction
    target, unused = mi.Point3f(*light.position), mi.Point2f(0.5, 0.5)
    frees: list[bool] = []
    colors: list[float] = []
    for number in np.flatnonzero(asked).tolist():
        hit = hits.interactions[number]
        frees.append(not blocked(hit.spawn_ray_to(target)))
        color = emitted(hit, unused)[1]
        colors += color[0], color[1], color[2]
    free, arriving = np.zeros(len(asked), dtype=bool), np.zeros((len(asked), 3))
    free[asked], arriving[asked] = frees, np.array(colors).reshape(-1, 3)
    return Feelers(free=free, arriving=arriving)


def ends(world: World, film: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where the rays through points of the film (n, 2) start and where they end [m], (n, 3) each."""
    mi, unused = world.mi, world.mi.Point2f(0.5, 0.5)
    rays = [world.sensor.sample_ray(0.0, 0.0, mi.Point2f(x, y), unused)[0] for x, y in film.tolist()]
    return np.array([tuple(ray.o) for ray in rays]), np.array([tuple(ray(ray.maxt)) for ray in rays])


def integrator(world: World) -> Any:
    """Return the scene's own."""
    return world.loaded.integrator()
