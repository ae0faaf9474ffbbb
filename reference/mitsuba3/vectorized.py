"""All rays at once through Mitsuba's LLVM variant."""

from typing import Any

import numpy as np

from rayproof.cases.scene import Camera, PointLight
from rayproof.reference.mitsuba3.tracing import Feelers, Hits, Interval, pixel_centers
from rayproof.reference.mitsuba3.worlds import World


def apart(mi: Any, integrator: Any) -> Any:
    """Return `integrator`, its rays and its radiances computed in memory between two short kernels.

    Mitsuba writes the numbers of camera and film into the code that it compiles. In one kernel with them, the
    integrator is compiled anew for every camera; on its own, once for every mixture of shapes.
    """
    import drjit as dr

    class Apart(mi.SamplingIntegrator):
        def __init__(self) -> None:
            super().__init__(mi.Properties())

        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
            dr.eval(ray)
            found = integrator.sample(scene, sampler, ray, medium, active)
            dr.eval(found)
            return found

    return Apart()


def trace(world: World, camera: Camera, interval: Interval | None) -> Hits:
    """Return what the rays through the pixel centres hit."""
    import drjit as dr

    mi = world.mi
    ray, _ = _rays(world, pixel_centers(camera))
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
    active = mi.Bool(asked.tolist())
    feeler = hits.interactions.spawn_ray_to(dr.opaque(mi.Point3f, light.position))
    free = ~world.loaded.ray_test(feeler, active) & active
    arriving = world.emitter.sample_direction(hits.interactions, mi.Point2f(0.5, 0.5), active)[1]
    dr.eval(free, arriving)
    return Feelers(free=free.numpy(), arriving=np.where(asked[:, np.newaxis], _rows(arriving), 0.0))


def ends(world: World, film: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where the rays through points of the film (n, 2) start and where they end [m], (n, 3) each."""
    ray, end = _rays(world, film)
    return _rows(ray.o), _rows(end)


def integrator(world: World) -> Any:
    """Return the scene's own, compiled apart from camera and film."""
    return apart(world.mi, world.loaded.integrator())


def _rays(world: World, film: np.ndarray) -> tuple[Any, Any]:
    """Return the rays through points of the film (n, 2) and where they end, by one short kernel for a camera."""
    import drjit as dr

    mi = world.mi
    x, y = (_float(mi, column) for column in film.T)
    ray, _ = world.sensor.sample_ray(0.0, 0.0, mi.Point2f(x, y), mi.Point2f(0.5, 0.5))
    end = ray(ray.maxt)
    dr.eval(ray, end)
    return ray, end


def _shape_indices(world: World, identity: Any, valid: Any) -> np.ndarray:
    """Return our index of each hit shape, -1 on a miss, from Mitsuba's number of the object in its registry."""
    import drjit as dr

    numbers = np.asarray(dr.reinterpret_array(world.mi.UInt32, world.loaded.shapes_dr()))
    table = np.full(numbers.max(initial=0) + 1, -1)
    table[numbers] = [world.indices[shape] for shape in world.loaded.shapes()]
    hit = np.asarray(valid)
    return np.where(hit, table[np.where(hit, np.asarray(identity), 0)], -1)


def _float(mi: Any, numbers: np.ndarray) -> Any:
    """Return numbers in Dr.Jit's own memory: numpy's it would use in place, and how that is aligned is compiled in."""
    return mi.Float(numbers.astype(np.float32).tolist())


def _rows(vector: Any) -> np.ndarray:
    """Return the vectors, (n, 3), component by component: to interleave them, Dr.Jit compiles a kernel for every n."""
    return np.stack([np.asarray(component, dtype=np.float64) for component in vector]).T
