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
Given = Mapping[Stage, Values]  # stages that are used unchanged, instead of being traced
NOTHING: Given = MappingProxyType({})
ROUNDED = 2.0**-20  # relative: a point that is no farther off is the same, written as float32


@dataclass(frozen=True, kw_only=True)
class Trace:
    """A scene that is ready to be traced by one configuration: its shapes and its camera on the device."""

    world: DeviceScene
    view: SampledView  # whose samples are shaded
    tiles: SampledView  # whose rays traverse the trees together: `view`, unless the kernel is split

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
        """Return a scene that is ready to be traced; `per_side` and `within` select the samples of a pixel (`View`)."""
        context = Context(
            scene=scene,
            configuration=configuration,
            types=array_types(configuration.precision),
            plan=plan(scene, configuration, samples=per_side) if chosen is None else chosen,
            buffers=DeviceBuffers() if buffers is None else buffers,
            parameters=parameters,
        )
        view_of = partial(SampledView.of, context, per_side=per_side, within=within)
        tiles = view_of(columns=context.plan.columns, rows=context.plan.rows)
        view = view_of(columns=1, rows=1) if context.plan.split else tiles
        return cls(world=DeviceScene(context), view=view, tiles=tiles)

    @property
    def dark(self) -> bool:
        """Return whether the scene has no lights or no shapes, so that no light needs to be computed."""
        return not (self.world.scene.shapes and self.world.scene.lights)


def images(trace: Trace, wanted: Collection[Stage], earlier: Given = NOTHING) -> dict[Stage, list[tuple[Any, ...]]]:
    """Return the channels of stages for each sample of a lane, with the specification's values on a miss.

    The channels of the camera are a sample's (sx, sy) and its pixel. Nothing is computed beyond the last wanted stage,
    and no light stage without lights. Stages in `earlier` are used unchanged.
    """
    stage_channels = _darkness(trace) if trace.dark else {}
    missing = [stage for stage in Stage if stage in wanted and stage not in stage_channels]
    if missing:
        for stage, values in light_path(trace, missing, earlier):
            stage_channels[stage] = values
            if stage is missing[-1]:
                break
    return {stage: [tuple(channels) for channels in stage_channels[stage]] for stage in wanted}


def radiance(trace: Trace) -> list[Any]:
    """Return radiance [W/(m^2 sr)] only. Packets that miss are not shaded."""
    if trace.dark:
        return list(_darkness(trace)[Stage.RADIANCE])
    rays = camera_rays(trace.view, sample_ndc(trace.view, sample_positions(trace.view)))
    hits = _nearest_hits(trace, rays)
    any_hit = reduced(operator.or_, [hit.distance < dr.inf for hit in hits])

    def shaded() -> list[Any]:
        *_, (_, values) = _shading(trace, rays, hits, (Stage.RADIANCE,), NOTHING)
        return list(values)

    return where(any_hit, shaded, [trace.world.types.Vector(0)] * len(rays))


def _darkness(trace: Trace) -> dict[Stage, Values]:
    """Return the stages about light of a scene without light or without shapes."""
    types, samples = trace.world.types, trace.view.lanes.tile
    black = [types.Vector(0)] * samples
    unlit = [(types.Float(0),) * len(trace.world.scene.lights)] * samples
    return {Stage.VISIBILITY: unlit, Stage.IRRADIANCE: black, Stage.EXITANCE: black, Stage.RADIANCE: black}


def light_path(trace: Trace, wanted: Collection[Stage], earlier: Given) -> Iterator[tuple[Stage, Values]]:
    """Yield each stage when it has been computed; camera and visibility only if wanted, as no stage depends on them."""
    camera, configuration = trace.world.scene.camera, trace.world.configuration
    ndc = sample_ndc(trace.view, sample_positions(trace.view))
    if Stage.CAMERA in wanted:
        pixels = [configuration["pixel"](*place, camera.width, camera.height) for place in ndc]
        trace.world.parameters.store(pixels, ndc)
        yield Stage.CAMERA, [(*place, *pixel) for place, pixel in zip(ndc, pixels, strict=True)]
    rays = camera_rays(trace.view, ndc)
    directions = _taken(trace, earlier, Stage.RAY, lambda: [ray.direction for ray in rays])
    yield Stage.RAY, directions
    rays = [Ray(origin=ray.origin, direction=direction) for ray, direction in zip(rays, directions, strict=True)]
    hits = _nearest_hits(trace, rays)
    yield Stage.OBJECT, [(hit.shape, hit.face) for hit in hits]
    yield Stage.DISTANCE, [(hit.distance,) for hit in hits]
    yield from _shading(trace, rays, hits, wanted, earlier)


def _nearest_hits(trace: Trace, rays: list[Ray]) -> list[NearestHit]:
    """Return the nearest hits of the camera rays, and let a kernel end."""
    view, world = trace.view, trace.world
    intervals = clipped(view, rays)
    if world.plan.split:
        (hit,) = world.bodies.nearest(rays, intervals)
        for hierarchy, tree_hits in zip(world.trees.hierarchies, _met_apart(trace), strict=True):
            hit = world.trees.nearer(hierarchy, hit, *tree_hits)
        hits = [hit]
    else:
        hits = world.nearest(rays, intervals, narrow=view.narrow)
    view.end([(hit.distance, hit.shape, hit.face, hit.number) for hit in hits])
    return hits


def _met_apart(trace: Trace) -> list[tuple[Any, Any]]:
    """Return t [m] and index of each ray's nearest hit in each tree, from a kernel that traces tiles of rays."""
    tiles, world = trace.tiles, trace.world
    positions = sample_positions(tiles)
    numbers = tiles.lanes.numbers(positions)
    rays = camera_rays(tiles, sample_ndc(tiles, positions))
    intervals = clipped(tiles, rays)
    world.parameters.store(numbers)
    count = tiles.lanes.width * tiles.lanes.height
    tree_hits = []
    for hierarchy in world.trees.hierarchies:
        distance, item = dr.empty(world.types.Float, count), dr.empty(world.types.Int, count)
        tile_hits = world.trees.met(hierarchy, rays, intervals, narrow=tiles.narrow)
        for number, tile_hit in zip(numbers, tile_hits, strict=True):
            for target, value in zip((distance, item), tile_hit, strict=True):
                dr.scatter(target, value, number, mode=dr.ReduceMode.Permute)
        tree_hits.append((distance, item))
    dr.eval(tree_hits)
    return tree_hits


def _shading(
    trace: Trace, rays: Sequence[Ray], hits: Sequence[NearestHit], wanted: Collection[Stage], earlier: Given
) -> Iterator[tuple[Stage, Values]]:
    """Yield the stages from the hits on, radiance last; there is light if any stage after the normal is asked for."""
    view, world = trace.view, trace.world
    traced = [
        HitShapes(world=world, ray=ray, hit=hit, mask=hit.distance < dr.inf)
        for ray, hit in zip(rays, hits, strict=True)
    ]
    shapes = _given_hits(traced, earlier) if Stage.OBJECT in earlier and Stage.DISTANCE in earlier else traced
    positions = _taken(trace, earlier, Stage.POSITION, lambda: [hit_point(hit) for hit in shapes])
    rounded = Stage.POSITION in earlier and Stage.VISIBILITY in wanted
    positions = _on_surface(traced, positions) if rounded else positions
    yield Stage.POSITION, [dr.select(hit.mask, position, 0) for hit, position in zip(shapes, positions, strict=True)]
    next_step(world.types, samples=len(shapes))
    normals = _taken(
        trace, earlier, Stage.NORMAL, lambda: [shading_normal(*hit) for hit in zip(shapes, positions, strict=True)]
    )
    yield Stage.NORMAL, normals
    surfaces = [surface(*hit) for hit in zip(shapes, positions, normals, strict=True)]
    view.end([item.arrays for item in surfaces])
    visibility = _given_lights(earlier) if Stage.VISIBILITY in earlier else None
    lit, irradiance = illuminate(world, surfaces, visibility=Stage.VISIBILITY in wanted, known=visibility)
    if Stage.VISIBILITY in wanted:
        unit = world.types.Float(1)
        yield Stage.VISIBILITY, [[dr.select(item, unit, 0) for item in lights] for lights in zip(*lit, strict=True)]
    irradiance = _taken(trace, earlier, Stage.IRRADIANCE, lambda: irradiance)
    yield Stage.IRRADIANCE, irradiance
    exitance = _taken(
        trace, earlier, Stage.EXITANCE, lambda: [_exitance(*item) for item in zip(surfaces, irradiance, strict=True)]
    )
    yield Stage.EXITANCE, exitance
    yield Stage.RADIANCE, [_radiance(*item) for item in zip(surfaces, exitance, strict=True)]


def _taken(trace: Trace, earlier: Given, stage: Stage, computed: Callable[[], Sequence[Any]]) -> list[Any]:
    """Return the vectors of a stage for each sample: the given ones, or else the computed ones."""
    return (
        [trace.world.types.Vector(*channels) for channels in earlier[stage]] if stage in earlier else list(computed())
    )


def _given_hits(traced: Sequence[HitShapes], earlier: Given) -> list[HitShapes]:
    """Return the hits whose shapes, faces and distances [m] are given, on the traced rays."""
    hits = []
    for hit, (shape, face), (t,) in zip(traced, earlier[Stage.OBJECT], earlier[Stage.DISTANCE], strict=True):
        world, number = hit.world, hit.hit.number
        shape, face = world.types.Int(shape), world.types.Int(face)
        distance = dr.select(shape >= 0, t, dr.inf)
        if world.trees.forest is not None:
            # If a triangle is given but none was hit, an arbitrary triangle is looked up.
            number = dr.clip(number, 0, sum(world.trees.forest.host.counts) - 1)
        nearest = NearestHit(distance=distance, shape=shape, face=face, number=number)
        hits.append(HitShapes(world=world, ray=hit.ray, hit=nearest, mask=distance < dr.inf))
    return hits


def _on_surface(traced: Sequence[HitShapes], positions: Sequence[Any]) -> list[Any]:
    """Return the start positions [m] of shadow rays: the traced ones if they equal the given ones up to rounding.

    The given positions are rounded, and so may be off the surface; the traced positions are on it.
    """
    standing = []
    for hit, position in zip(traced, positions, strict=True):
        on_it = hit_point(hit)
        moved = dr.norm(position - on_it) > ROUNDED * (dr.norm(on_it) + dr.norm(hit.ray.origin))
        standing.append(dr.select(moved | ~hit.mask, position, on_it))
    return standing


def _given_lights(earlier: Given) -> list[list[Any]]:
    """Return the masks of visible lights per light and sample, from the given visibility."""
    return [[visible > 0 for visible in light] for light in zip(*earlier[Stage.VISIBILITY], strict=True)]


def _exitance(surface: SurfacePoint, irradiance: Any) -> Any:
    """Return M [W/m^2]."""
    world = surface.met.world
    leaving = world.configuration["exitance"](surface.albedo, irradiance)
    if all(channel > 0 for shape in world.scene.shapes for channel in shape.albedo):
        return leaving
    # Black stays black under an irradiance that overflowed: 0 times infinity would be NaN.
    return dr.select((surface.albedo == 0) & dr.isinf(irradiance), 0, leaving)


def _radiance(surface: SurfacePoint, exitance: Any) -> Any:
    """Return L [W/(m^2 sr)]."""
    world = surface.met.world
    slot = "radiance_simplified" if world.scene.shading == "simplified" else "radiance"
    return dr.select(surface.hidden, 0, world.configuration[slot](exitance))
