"""All rays at once through Mitsuba's LLVM variant."""

from typing import Any

import numpy as np

from cases.scene import Camera, PointLight
from reference.mitsuba3.tracing import Feelers, Hits, Interval, pixel_centers
from reference.mitsuba3.worlds import World


def trace(world: World, camera: Camera, interval: Interval | None) -> Hits:
    """Return what the rays through the pixel centres hit."""
    import drjit as dr

    mi = world.mi
    x, y = pixel_centers(camera).astype(np.float32).T
    ray, _ = world.sensor.sample_ray(0.0, 0.0, mi.Point2f(mi.Float(x), mi.Float(y)), mi.Point2f(0.5, 0.5))
    if interval is not None:
        # Opaque, so that one kernel serves every camera.
        start, end = dr.opaque(mi.Float, interval.start), dr.opaque(mi.Float, interval.end - interval.start)
        origin = dr.opaque(mi.Point3f, camera.eye)
        ray = mi.Ray3f(origin + start * ray.d, ray.d, end, 0.0, ray.wavelengths)
    hit = world.loaded.ray_intersect(ray)
    valid = hit.is_valid()
    identity = dr.reinterpret_array(mi.UInt32, dr.select(hit.instance != None, hit.instance, hit.shape))  # noqa: E711
    position, normal = hit.p & valid, hit.n & valid
    interactions = mi.Interaction3f(hit.t, 0.0, [], position, normal)
    dr.eval(ray.d, valid, identity, hit.prim_index, interactions)
    return Hits(
        direction=_rows(ray.d),
        shape=_shape_indices(world, identity, valid),
        primitive=np.where(valid.numpy(), hit.prim_index.numpy(), 0).astype(int),
        position=_rows(position),
        normal=_rows(normal),
        interactions=interactions,
    )


def feel(world: World, hits: Hits, light: PointLight, asked: np.ndarray) -> Feelers:
    """Return what arrives from `light` at the hits that are `asked` about, (n,) bool."""
    import drjit as dr

    mi = world.mi
    world.place(light)
    active = mi.Bool(asked)
    feeler = hits.interactions.spawn_ray_to(dr.opaque(mi.Point3f, light.position))
    free = ~world.loaded.ray_test(feeler, active) & active
    arriving = world.emitter.sample_direction(hits.interactions, mi.Point2f(0.5, 0.5), active)[1]
    dr.eval(free, arriving)
    return Feelers(free=free.numpy(), arriving=np.where(asked[:, np.newaxis], _rows(arriving), 0.0))


def _shape_indices(world: World, identity: Any, valid: Any) -> np.ndarray:
    """Return our index of each hit shape, -1 on a miss, from Mitsuba's number of the object in its registry."""
    import drjit as dr

    numbers = np.asarray(dr.reinterpret_array(world.mi.UInt32, world.loaded.shapes_dr()))
    table = np.full(numbers.max(initial=0) + 1, -1)
    table[numbers] = [world.indices[shape] for shape in world.loaded.shapes()]
    hit = np.asarray(valid)
    return np.where(hit, table[np.where(hit, np.asarray(identity), 0)], -1)


def _rows(vector: Any) -> np.ndarray:
    return np.asarray(vector, dtype=np.float64).T
