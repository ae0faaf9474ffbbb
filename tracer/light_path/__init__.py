"""`Trace` and `light_path`: all stages in order, from ray to radiance, for the samples of a lane.

Every stage is a list with an entry for each sample of a lane (`tracer.kernel.arrays`): Dr.Jit arrays, evaluated only
where `KernelConstants.store` ends a kernel.
"""

import operator
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

import drjit as dr

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arrays import array_types, next_step, where
from rayproof.tracer.kernel.parameters import LITERALS, DeviceBuffers, KernelConstants
from rayproof.tracer.light_path.camera_stage import SampledView, camera_rays, clipped, sample_ndc, sample_positions
from rayproof.tracer.light_path.illumination import illuminate
from rayproof.tracer.light_path.surfaces import DeviceScene, HitShapes, SurfacePoint, hit_point, shading_normal, surface
from rayproof.tracer.plan import Context, Plan, plan
from rayproof.tracer.rays import NearestHit, Ray
from rayproof.tracer.trees.beams import reduced

Values = Sequence[Iterable[Any]]  # of one stage: for each sample of a lane, its channels
Given = Mapping[Stage, Values]  # stages that are taken as they are, instead of being traced
NOTHING: Given = MappingProxyType({})
ROUNDED = 2.0**-20  # relative: a point that is no farther off is the same, written as float32


@dataclass(frozen=True, kw_only=True)
class Trace:
    """A scene that is ready to be traced by one configuration: its shapes and its camera on the device."""

    world: DeviceScene
    view: SampledView  # whose samples are shaded
    tiles: SampledView  # whose rays go through the trees together: the same, unless that is a kernel of its own

    @classmethod
    def of(
        cls,
        scene: Scene,
        configuration: Configuration,
        *,
        per_side: int,
        within: tuple[Any, Any] | None = None,
        chosen: Plan | None = None,
        buffers: DeviceBuffers | None = None,
        parameters: KernelConstants = LITERALS,
    ) -> "Trace":
        """Return a scene ready to be traced; `per_side` and `within` say which samples of a pixel (`SampledView`)."""
        context = Context(
            scene=scene,
            configuration=configuration,
            types=array_types(configuration.precision),
            plan=plan(scene, configuration, samples=per_side) if chosen is None else chosen,
            buffers=DeviceBuffers() if buffers is None else buffers,
            parameters=parameters,
        )
        seen = partial(SampledView.of, context, per_side=per_side, within=within)
        tiles = seen(columns=context.plan.columns, rows=context.plan.rows)
        view = seen(columns=1, rows=1) if context.plan.split else tiles
        return cls(world=DeviceScene(context), view=view, tiles=tiles)

    @property
    def dark(self) -> bool:
        """Return whether there is no light or nothing to light, so that nothing about it needs computing."""
        return not (self.world.scene.shapes and self.world.scene.lights)


def images(trace: Trace, wanted: Collection[Stage], given: Given = NOTHING) -> dict[Stage, list[tuple[Any, ...]]]:
    """Return the channels of stages for each sample of a lane, with the specification's values where nothing was hit.

    Those of the camera are a sample's (sx, sy) and its pixel. What comes after the last stage wanted is not computed,
    nor is anything about light where there is none. `given` stages before those wanted are taken as they are.
    """
    found = _darkness(trace) if trace.dark else {}
    missing = [stage for stage in Stage if stage in wanted and stage not in found]
    if missing:
        for stage, values in light_path(trace, missing, given):
            found[stage] = values
            if stage is missing[-1]:
                break
    return {stage: [tuple(channels) for channels in found[stage]] for stage in wanted}


def radiance(trace: Trace) -> list[Any]:
    """Return radiance [W/(m^2 sr)] only. Packets that miss are not shaded."""
    if trace.dark:
        return list(_darkness(trace)[Stage.RADIANCE])
    rays = camera_rays(trace.view, sample_ndc(trace.view, sample_positions(trace.view)))
    hits = _nearest_hits(trace, rays)
    some = reduced(operator.or_, [hit.distance < dr.inf for hit in hits])

    def shaded() -> list[Any]:
        *_, (_, values) = _shading(trace, rays, hits, (Stage.RADIANCE,), NOTHING)
        return list(values)

    return where(some, shaded, [trace.world.types.Vector(0)] * len(rays))


def _darkness(trace: Trace) -> dict[Stage, Values]:
    """Return the stages about light of a scene without light or without shapes."""
    types, samples = trace.world.types, trace.view.lanes.tile
    black = [types.Vector(0)] * samples
    unlit = [(types.Float(0),) * len(trace.world.scene.lights)] * samples
    return {Stage.VISIBILITY: unlit, Stage.IRRADIANCE: black, Stage.EXITANCE: black, Stage.RADIANCE: black}


def light_path(trace: Trace, wanted: Collection[Stage], given: Given) -> Iterator[tuple[Stage, Values]]:
    """Yield each stage when it has been computed; camera and visibility, on which none depends, only where wanted."""
    camera, configuration = trace.world.scene.camera, trace.world.configuration
    ndc = sample_ndc(trace.view, sample_positions(trace.view))
    if Stage.CAMERA in wanted:
        pixels = [configuration["pixel"](*place, camera.width, camera.height) for place in ndc]
        trace.world.parameters.store(pixels, ndc)
        yield Stage.CAMERA, [(*place, *pixel) for place, pixel in zip(ndc, pixels, strict=True)]
    rays = camera_rays(trace.view, ndc)
    directions = _taken(trace, given, Stage.RAY, lambda: [ray.direction for ray in rays])
    yield Stage.RAY, directions
    rays = [Ray(origin=ray.origin, direction=direction) for ray, direction in zip(rays, directions, strict=True)]
    hits = _nearest_hits(trace, rays)
    yield Stage.OBJECT, [(hit.shape, hit.face) for hit in hits]
    yield Stage.DISTANCE, [(hit.distance,) for hit in hits]
    yield from _shading(trace, rays, hits, wanted, given)


def _nearest_hits(trace: Trace, rays: list[Ray]) -> list[NearestHit]:
    """Return the nearest hits of the camera rays, and let a kernel end."""
    view, world = trace.view, trace.world
    intervals = clipped(view, rays)
    if world.plan.split:
        (hit,) = world.bodies.nearest(rays, intervals)
        for hierarchy, met in zip(world.trees.hierarchies, _met_apart(trace), strict=True):
            hit = world.trees.nearer(hierarchy, hit, *met)
        hits = [hit]
    else:
        hits = world.nearest(rays, intervals, narrow=view.narrow)
    view.end([(hit.distance, hit.shape, hit.face, hit.number) for hit in hits])
    return hits


def _met_apart(trace: Trace) -> list[tuple[Any, Any]]:
    """Return t [m] and number of what each ray meets in each tree: by tiles of rays, one per lane, and memory."""
    tiles, world = trace.tiles, trace.world
    positions = sample_positions(tiles)
    numbers = tiles.lanes.numbers(positions)
    rays = camera_rays(tiles, sample_ndc(tiles, positions))
    intervals = clipped(tiles, rays)
    world.parameters.store(numbers)
    count = tiles.lanes.width * tiles.lanes.height
    found = []
    for hierarchy in world.trees.hierarchies:
        distance, item = dr.empty(world.types.Float, count), dr.empty(world.types.Int, count)
        met = world.trees.met(hierarchy, rays, intervals, narrow=tiles.narrow)
        for number, one in zip(numbers, met, strict=True):
            for target, value in zip((distance, item), one, strict=True):
                dr.scatter(target, value, number, mode=dr.ReduceMode.Permute)
        found.append((distance, item))
    dr.eval(found)
    return found


def _shading(
    trace: Trace, rays: Sequence[Ray], hits: Sequence[NearestHit], wanted: Collection[Stage], given: Given
) -> Iterator[tuple[Stage, Values]]:
    """Yield the stages from the hits on, radiance last; there is light if any stage after the normal is asked for."""
    view, world = trace.view, trace.world
    traced = [
        HitShapes(world=world, ray=ray, hit=hit, mask=hit.distance < dr.inf)
        for ray, hit in zip(rays, hits, strict=True)
    ]
    met = _given_hits(traced, given) if Stage.OBJECT in given and Stage.DISTANCE in given else traced
    positions = _taken(trace, given, Stage.POSITION, lambda: [hit_point(hit) for hit in met])
    rounded = Stage.POSITION in given and Stage.VISIBILITY in wanted
    positions = _on_surface(traced, positions) if rounded else positions
    yield Stage.POSITION, [dr.select(hit.mask, position, 0) for hit, position in zip(met, positions, strict=True)]
    next_step(world.types, samples=len(met))
    normals = _taken(
        trace, given, Stage.NORMAL, lambda: [shading_normal(*hit) for hit in zip(met, positions, strict=True)]
    )
    yield Stage.NORMAL, normals
    surfaces = [surface(*hit) for hit in zip(met, positions, normals, strict=True)]
    view.end([seen.arrays for seen in surfaces])
    known = _given_lights(given) if Stage.VISIBILITY in given else None
    lit, irradiance = illuminate(world, surfaces, visibility=Stage.VISIBILITY in wanted, known=known)
    if Stage.VISIBILITY in wanted:
        one = world.types.Float(1)
        yield Stage.VISIBILITY, [[dr.select(seen, one, 0) for seen in lights] for lights in zip(*lit, strict=True)]
    irradiance = _taken(trace, given, Stage.IRRADIANCE, lambda: irradiance)
    yield Stage.IRRADIANCE, irradiance
    exitance = _taken(
        trace, given, Stage.EXITANCE, lambda: [_exitance(*seen) for seen in zip(surfaces, irradiance, strict=True)]
    )
    yield Stage.EXITANCE, exitance
    yield Stage.RADIANCE, [_radiance(*seen) for seen in zip(surfaces, exitance, strict=True)]


def _taken(trace: Trace, given: Given, stage: Stage, computed: Callable[[], Sequence[Any]]) -> list[Any]:
    """Return the vectors of a stage for each sample: those given, else those computed."""
    return [trace.world.types.Vector(*one) for one in given[stage]] if stage in given else list(computed())


def _given_hits(traced: Sequence[HitShapes], given: Given) -> list[HitShapes]:
    """Return the hits whose shapes, faces and distances [m] are given, on the traced rays."""
    hits = []
    for hit, (shape, face), (t,) in zip(traced, given[Stage.OBJECT], given[Stage.DISTANCE], strict=True):
        world, number = hit.world, hit.hit.number
        shape, face = world.types.Int(shape), world.types.Int(face)
        distance = dr.select(shape >= 0, t, dr.inf)
        if world.trees.forest is not None:
            # Where no triangle was met but one was given, some triangle is looked up.
            number = dr.clip(number, 0, sum(world.trees.forest.host.counts) - 1)
        known = NearestHit(distance=distance, shape=shape, face=face, number=number)
        hits.append(HitShapes(world=world, ray=hit.ray, hit=known, mask=distance < dr.inf))
    return hits


def _on_surface(traced: Sequence[HitShapes], positions: Sequence[Any]) -> list[Any]:
    """Return given positions [m] for shadow rays to start from: where the traced one is the same up to rounding, that.

    Rounding has moved what is given off the surface, and what is traced stands on it.
    """
    standing = []
    for hit, position in zip(traced, positions, strict=True):
        on_it = hit_point(hit)
        moved = dr.norm(position - on_it) > ROUNDED * (dr.norm(on_it) + dr.norm(hit.ray.origin))
        standing.append(dr.select(moved | ~hit.mask, position, on_it))
    return standing


def _given_lights(given: Given) -> list[list[Any]]:
    """Return which lights each sample sees, light by light, as given."""
    return [[seen > 0 for seen in light] for light in zip(*given[Stage.VISIBILITY], strict=True)]


def _exitance(surface: SurfacePoint, irradiance: Any) -> Any:
    """Return M [W/m^2]."""
    world = surface.met.world
    leaving = world.configuration["exitance"](surface.albedo, irradiance)
    if all(channel > 0 for shape in world.scene.shapes for channel in shape.albedo):
        return leaving
    # Under an irradiance that overflowed, black stays black: 0 times infinity would be no number.
    return dr.select((surface.albedo == 0) & dr.isinf(irradiance), 0, leaving)


def _radiance(surface: SurfacePoint, exitance: Any) -> Any:
    """Return L [W/(m^2 sr)]."""
    world = surface.met.world
    slot = "radiance_simplified" if world.scene.shading == "simplified" else "radiance"
    return dr.select(surface.hidden, 0, world.configuration[slot](exitance))
