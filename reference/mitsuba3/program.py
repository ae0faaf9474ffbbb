"""Mitsuba called ray by ray or for all rays at once: variants, hits, shadow rays, stages, the integrator's radiance.

The scalar variant is called ray by ray, without a compiler; the LLVM variant is called for all rays at once. The active
variant is global to the process. The camera stage comes from Mitsuba's own matrices and from the ends of its rays,
radiance from its own `direct` integrator. Mitsuba's camera space has x to the left; its projection ends on the film,
where x and y run from 0 at the top left to 1.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from importlib.metadata import version as installed_version
from importlib.util import find_spec
from typing import Any

import numpy as np

from rayproof.cases.scene import Camera, Mesh, PointLight, Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.mitsuba3.scene import MitsubaScene


def switch_to(variant: str) -> Any:
    """Return the module `mitsuba` switched to `variant`.

    Objects made under another variant stay valid but do not mix with those made afterwards, so every render
    switches first and keeps nothing.

    Raises:
        RuntimeError: the variant cannot run on this machine.

    """
    if (why := unavailable(variant)) is not None:
        raise RuntimeError(why)
    import mitsuba

    mitsuba.set_variant(variant)
    return mitsuba


def missing() -> str | None:
    """Return a sentence with the command that installs Mitsuba, or None if it is installed."""
    return "Mitsuba is not installed; pip install mitsuba." if find_spec("mitsuba") is None else None


def unavailable(variant: str) -> str | None:
    """Return a sentence with the reason why the variant cannot run on this machine, or None if it can."""
    if (why := missing()) is not None:
        return why
    if variant.startswith("llvm"):
        import drjit

        # Asked first, because using the backend without a library kills the process.
        if not drjit.has_backend(drjit.JitBackend.LLVM):
            return "Dr.Jit finds no LLVM library that it accepts; set DRJIT_LIBLLVM_PATH to one, version 17 or later."
    return None


def program_version(variant: str) -> str:
    """Return program, version and variant."""
    # Importing Mitsuba takes longer than all else that a run does before its first render.
    return f"Mitsuba {installed_version('mitsuba')} ({variant})"


@dataclass(frozen=True, kw_only=True)
class ClipInterval:
    """The piece of a ray [m along its unit direction from the eye] on which a hit counts."""

    start: float
    end: float


@dataclass(frozen=True, kw_only=True)
class MitsubaHits:
    """The nearest hits, float64 whatever computed them; misses have shape -1, and zeros elsewhere."""

    direction: np.ndarray  # (n, 3), unit
    shape: np.ndarray  # (n,) index into the scene's shapes
    primitive: np.ndarray  # (n,) Mitsuba's index of the triangle
    position: np.ndarray  # (n, 3), m
    normal: np.ndarray  # (n, 3), unit, geometric, as the surface is oriented
    interactions: Any  # Mitsuba's own records, where shadow rays start


@dataclass(frozen=True, kw_only=True)
class MitsubaShadowRays:
    """The light that arrives from one light source at the hits."""

    free: np.ndarray  # (n,) bool: nothing between hit and light; False if not wanted
    arriving: np.ndarray  # (n, 3) W/m^2 on a surface that faces the light, were nothing in between


def own_interval(scene: Scene) -> ClipInterval | None:
    """Return the interval [m] in which hits of camera rays count; None if Mitsuba's sensor clips like the scene."""
    if scene.clip == "depth":
        return None
    if scene.clip == "shell":
        return ClipInterval(start=scene.camera.near, end=scene.camera.far)
    return ClipInterval(start=0.0, end=float("inf"))


def pixel_centers(camera: Camera) -> np.ndarray:
    """Return the pixel centres on Mitsuba's film, (n, 2), each coordinate in (0, 1), row by row from the top left."""
    row, column = np.mgrid[0 : camera.height, 0 : camera.width]
    centers = np.stack([(column + 0.5) / camera.width, (row + 0.5) / camera.height], axis=-1)
    return centers.reshape(-1, 2)


MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
FILM_TO_CLIP = np.array([[2.0, 0, 0, -1], [0, -2.0, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]])
# Where the frustum's edges meet the film, in the order that the answer keeps.
FILM_CORNERS = np.array([(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)])

Ends = Callable[[MitsubaScene, np.ndarray], tuple[np.ndarray, np.ndarray]]


def camera_answer(world: MitsubaScene, camera: Camera, ends: Ends) -> dict[str, np.ndarray]:
    """Return the matrices, the frustum's corners [m] and the pixels' coordinates, as `cases.stages` orders them."""
    to_world, to_film = world.sensor.world_transform(), world.sensor.projection_transform()
    # The film coordinates for Mitsuba, in its own precision.
    film = pixel_centers(camera).astype(np.float32).astype(np.float64)
    size, shape = (camera.width, camera.height), (camera.height, camera.width)
    return {
        "view": MIRROR @ _matrix(to_world.inverse()),
        "view_inverse": _matrix(to_world) @ MIRROR,
        "projection": FILM_TO_CLIP @ _matrix(to_film) @ MIRROR,
        "projection_inverse": MIRROR @ _matrix(to_film.inverse()) @ np.linalg.inv(FILM_TO_CLIP),
        "frustum_corners": np.concatenate(ends(world, FILM_CORNERS)),
        "ndc": (film * (2.0, -2.0) + (-1.0, 1.0)).reshape(*shape, 2),
        "pixel": (film * size).reshape(*shape, 2),
    }


def _matrix(transform: Any) -> np.ndarray:
    return np.asarray(transform.matrix, dtype=np.float64).reshape(4, 4)


def radiance_image(world: MitsubaScene, scene: Scene, integrator: Any, samples: int) -> np.ndarray:
    """Return the mean radiance [W/(m^2 sr)] over samples x samples points per pixel, (lines, width, 3).

    One pass per light, summed here in float64.
    """
    total = np.zeros((scene.camera.height, scene.camera.width, 3))
    for light in scene.lights:
        world.place(light)
        image = world.mi.render(world.loaded, integrator=integrator, spp=samples * samples, seed=0)
        total += np.asarray(image, dtype=np.float64)
    return total


def clip_planes_beyond(camera: Camera, hits: MitsubaHits) -> tuple[float, float]:
    """Return depths [m] of a near and a far plane with all hits between them and a wide margin."""
    distance = np.linalg.norm(hits.position[hits.shape >= 0] - np.asarray(camera.eye), axis=1)
    nearest, farthest = distance.min(initial=camera.near), distance.max(initial=camera.far)
    return float(nearest) * 1e-3, float(farthest) * 1e3


Feel = Callable[[MitsubaScene, MitsubaHits, PointLight, np.ndarray], MitsubaShadowRays]


def stage_answers(
    scene: Scene, world: MitsubaScene, hits: MitsubaHits, feel: Feel, stages: Collection[Stage]
) -> StageImages:
    """Return every stage from ray to exitance that is among `stages`, (height, width, channels), float64."""
    hit = hits.shape >= 0
    distance = np.linalg.norm(hits.position - np.asarray(scene.camera.eye), axis=1)
    normal = _shading_normals(scene, hits)
    answers: dict[Stage, np.ndarray] = {
        Stage.RAY: hits.direction,
        Stage.OBJECT: np.column_stack([hits.shape, _faces(scene, world, hits)]),
        # From the eye: Mitsuba's own t starts at the near plane.
        Stage.DISTANCE: np.where(hit, distance, np.inf)[:, np.newaxis],
        Stage.POSITION: hits.position,
        Stage.NORMAL: normal,
    }
    if {Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE} & set(stages):
        answers |= _lit(scene, world, hits, normal, feel)
    shape = (scene.camera.height, scene.camera.width, -1)
    return {
        stage: answers[stage].astype(np.float64).reshape(*shape[:2], answers[stage].shape[1])
        for stage in stages
        if stage in answers
    }


def _lit(
    scene: Scene, world: MitsubaScene, hits: MitsubaHits, normal: np.ndarray, feel: Feel
) -> dict[Stage, np.ndarray]:
    """Return visibility, irradiance and exitance."""
    hit = hits.shape >= 0
    visibility = np.zeros((len(hit), len(scene.lights)))
    irradiance = np.zeros((len(hit), 3))
    for number, light in enumerate(scene.lights):
        to_light = np.asarray(light.position) - hits.position
        distance = np.linalg.norm(to_light, axis=1)
        facing = np.einsum("ij,ij->i", normal, to_light)
        above = hit & (facing > 0)
        shadow_rays = feel(world, hits, light, above)
        visibility[:, number] = shadow_rays.free
        cosine = np.divide(facing, distance, out=np.zeros_like(facing), where=shadow_rays.free)
        irradiance += np.where(shadow_rays.free, cosine, 0.0)[:, np.newaxis] * shadow_rays.arriving
    albedo = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])
    return {
        Stage.VISIBILITY: visibility,
        Stage.IRRADIANCE: irradiance,
        Stage.EXITANCE: albedo[hits.shape] * irradiance,
    }


def _faces(scene: Scene, world: MitsubaScene, hits: MitsubaHits) -> np.ndarray:
    """Return the face index: a mesh's triangle, 0 for other shapes, -1 on a miss."""
    faces = np.where(hits.shape >= 0, 0, -1)
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Mesh):
            here = hits.shape == index
            faces[here] = world.faces[index][hits.primitive[here]]
    return faces


def _shading_normals(scene: Scene, hits: MitsubaHits) -> np.ndarray:
    """Return the specification's N: outward, and on two-sided shapes towards the viewer."""
    two_sided = np.array([*(shape.two_sided for shape in scene.shapes), False])[hits.shape]
    away = np.einsum("ij,ij->i", hits.normal, hits.direction) > 0
    return np.where((two_sided & away)[:, np.newaxis], -hits.normal, hits.normal)


def trace_one_by_one(world: MitsubaScene, camera: Camera, interval: ClipInterval | None) -> MitsubaHits:
    """Return the hits of the rays through the pixel centres, traced one by one."""
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
    return MitsubaHits(
        direction=np.array(directions).reshape(-1, 3),
        shape=shape,
        primitive=primitive,
        position=position,
        normal=normal,
        interactions=dict(zip(hit_by, interactions, strict=True)),
    )


def feel_one_by_one(world: MitsubaScene, hits: MitsubaHits, light: PointLight, wanted: np.ndarray) -> MitsubaShadowRays:
    """Return the visibility and the light of `light` at the `wanted` hits, (n,) bool, ray by ray."""
    mi = world.mi
    world.place(light)
    blocked, emitted = world.loaded.ray_test, world.emitter.sample_direction
    target, unused = mi.Point3f(*light.position), mi.Point2f(0.5, 0.5)
    frees: list[bool] = []
    colors: list[float] = []
    for number in np.flatnonzero(wanted).tolist():
        hit = hits.interactions[number]
        frees.append(not blocked(hit.spawn_ray_to(target)))
        color = emitted(hit, unused)[1]
        colors += color[0], color[1], color[2]
    free, arriving = np.zeros(len(wanted), dtype=bool), np.zeros((len(wanted), 3))
    free[wanted], arriving[wanted] = frees, np.array(colors).reshape(-1, 3)
    return MitsubaShadowRays(free=free, arriving=arriving)


def ends_one_by_one(world: MitsubaScene, film: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the start and end points [m], (n, 3) each, of the rays through points of the film (n, 2)."""
    mi, unused = world.mi, world.mi.Point2f(0.5, 0.5)
    rays = [world.sensor.sample_ray(0.0, 0.0, mi.Point2f(x, y), unused)[0] for x, y in film.tolist()]
    return np.array([tuple(ray.o) for ray in rays]), np.array([tuple(ray(ray.maxt)) for ray in rays])


def integrator_one_by_one(world: MitsubaScene) -> Any:
    """Return the scene's own integrator."""
    return world.loaded.integrator()


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
            result = integrator.sample(scene, sampler, ray, medium, active)
            dr.eval(result)
            return result

    return Apart()


def trace_together(world: MitsubaScene, camera: Camera, interval: ClipInterval | None) -> MitsubaHits:
    """Return the hits of the rays through the pixel centres, traced in one kernel."""
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
    return MitsubaHits(
        direction=_rows(ray.d),
        shape=_shape_indices(world, identity, valid),
        primitive=np.where(valid.numpy(), hit.prim_index.numpy(), 0).astype(int),
        position=_rows(position),
        normal=_rows(normal),
        interactions=interactions,
    )


def feel_together(world: MitsubaScene, hits: MitsubaHits, light: PointLight, wanted: np.ndarray) -> MitsubaShadowRays:
    """Return the visibility and the light of `light` at the `wanted` hits, (n,) bool, in one kernel."""
    import drjit as dr

    mi = world.mi
    world.place(light)
    active = mi.Bool(wanted.tolist())
    shadow_ray = hits.interactions.spawn_ray_to(dr.opaque(mi.Point3f, light.position))
    free = ~world.loaded.ray_test(shadow_ray, active) & active
    arriving = world.emitter.sample_direction(hits.interactions, mi.Point2f(0.5, 0.5), active)[1]
    dr.eval(free, arriving)
    return MitsubaShadowRays(free=free.numpy(), arriving=np.where(wanted[:, np.newaxis], _rows(arriving), 0.0))


def ends_together(world: MitsubaScene, film: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the start and end points [m], (n, 3) each, of the rays through points of the film (n, 2)."""
    ray, end = _rays(world, film)
    return _rows(ray.o), _rows(end)


def integrator_together(world: MitsubaScene) -> Any:
    """Return the scene's own integrator, compiled apart from camera and film."""
    return apart(world.mi, world.loaded.integrator())


def _rays(world: MitsubaScene, film: np.ndarray) -> tuple[Any, Any]:
    """Return the rays through points of the film (n, 2) and where they end, by one short kernel for a camera."""
    import drjit as dr

    mi = world.mi
    x, y = (_float(mi, column) for column in film.T)
    ray, _ = world.sensor.sample_ray(0.0, 0.0, mi.Point2f(x, y), mi.Point2f(0.5, 0.5))
    end = ray(ray.maxt)
    dr.eval(ray, end)
    return ray, end


def _shape_indices(world: MitsubaScene, identity: Any, valid: Any) -> np.ndarray:
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


@dataclass(frozen=True, kw_only=True)
class Tracing:
    """How a variant follows rays."""

    trace: Callable[[MitsubaScene, Camera, ClipInterval | None], MitsubaHits]
    feel: Feel
    ends: Ends
    integrator: Callable[[MitsubaScene], Any]


TRACING = {
    "scalar_rgb": Tracing(
        trace=trace_one_by_one, feel=feel_one_by_one, ends=ends_one_by_one, integrator=integrator_one_by_one
    ),
    "llvm_ad_rgb": Tracing(
        trace=trace_together, feel=feel_together, ends=ends_together, integrator=integrator_together
    ),
}
