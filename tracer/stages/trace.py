"""From pixel to radiance: every stage computed when it is first asked for, and not before."""

import operator
from copy import copy
from functools import cached_property
from typing import Any

import drjit as dr

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.tracer.acceleration.packet_bounds import reduced
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.context import Context
from rayproof.tracer.device.arrays import array_types
from rayproof.tracer.device.buffers import DeviceBuffers
from rayproof.tracer.device.coherent_branches import where
from rayproof.tracer.device.kernel_constants import LITERALS, KernelConstants
from rayproof.tracer.device.scheduling import next_step
from rayproof.tracer.device.tiles import Lanes
from rayproof.tracer.plan import Plan, plan
from rayproof.tracer.rays import NearestHit, Ray
from rayproof.tracer.stages.camera_rays import CameraRays
from rayproof.tracer.stages.illumination import Illumination
from rayproof.tracer.stages.intersector import World
from rayproof.tracer.stages.surfaces import Surfaces


class Trace:
    """One scene by one configuration; the stages are Dr.Jit arrays, evaluated only where `parameters` ends a kernel.

    A lane holds one or several samples (`tracer.device.tiles`); every stage is a list with an entry for each of them.
    per_side and `within` say which samples of a pixel (`tracer.stages.camera_rays`).
    """

    def __init__(
        self,
        scene: Scene,
        configuration: Configuration,
        *,
        per_side: int,
        within: tuple[Any, Any] | None = None,
        chosen: Plan | None = None,
        buffers: DeviceBuffers | None = None,
        parameters: KernelConstants = LITERALS,
    ) -> None:
        self.scene, self.configuration = scene, configuration
        self.types = array_types(configuration.precision)
        self.plan = plan(scene, configuration, samples=per_side) if chosen is None else chosen
        self._parameters = parameters
        context = Context(
            scene=scene,
            configuration=configuration,
            types=self.types,
            plan=self.plan,
            buffers=DeviceBuffers() if buffers is None else buffers,
            parameters=parameters,
        )
        self.world = World(context)

        def seen(columns: int, rows: int) -> CameraRays:
            return CameraRays(context, columns=columns, rows=rows, per_side=per_side, within=within)

        # Where a kernel of its own takes tiles of rays through the trees, what comes after takes one per lane.
        self._tiles = seen(self.plan.columns, self.plan.rows)
        self.seen = seen(1, 1) if self.plan.split else self._tiles

    @property
    def lanes(self) -> Lanes:
        """Return which samples each lane computes."""
        return self.seen.lanes

    @property
    def rays(self) -> list[Ray]:
        """Return the camera rays, with unit directions."""
        return self.seen.rays

    @cached_property
    def hits(self) -> list[NearestHit]:
        """Return the nearest hits of the camera rays."""
        seen = self.seen
        if self.plan.split:
            (hit,) = self.world.bodies.nearest(seen.rays, seen.intervals)
            for hierarchy, met in zip(self.world.trees.hierarchies, self._met_apart(), strict=True):
                hit = self.world.trees.nearer(hierarchy, hit, *met)
            found = [hit]
        else:
            found = self.world.nearest(seen.rays, seen.intervals, narrow=seen.narrow)
        seen.end([(one.distance, one.shape, one.face, one.number) for one in found])
        return found

    def _met_apart(self) -> list[tuple[Any, Any]]:
        """Return t [m] and number of what each ray meets in each tree: by tiles of rays, one per lane, and memory."""
        tiles, count = self._tiles, self.lanes.width * self.lanes.height
        numbers = tiles.lanes.numbers(tiles.positions)
        rays, intervals = tiles.rays, tiles.intervals
        self._parameters.store(numbers)
        found = []
        for hierarchy in self.world.trees.hierarchies:
            distance, item = dr.empty(self.types.Float, count), dr.empty(self.types.Int, count)
            met = self.world.trees.met(hierarchy, rays, intervals, narrow=tiles.narrow)
            for number, one in zip(numbers, met, strict=True):
                for target, value in zip((distance, item), one, strict=True):
                    dr.scatter(target, value, number, mode=dr.ReduceMode.Permute)
            found.append((distance, item))
        dr.eval(found)
        return found

    @cached_property
    def surfaces(self) -> list[Surfaces]:
        """Return the surfaces that the camera rays hit."""
        return [Surfaces(self.world, *found, eye=self.seen.eye) for found in zip(self.rays, self.hits, strict=True)]

    def _lit_surfaces(self) -> list[Surfaces]:
        """Return the surfaces with what every light needs to know of them."""
        for one in self.surfaces:
            _ = one.mask, one.position
        next_step(self.types, samples=self.lanes.tile)
        for one in self.surfaces:
            _ = one.normal
        self.seen.end([one.arrays for one in self.surfaces])
        return self.surfaces

    @cached_property
    def illumination(self) -> Illumination:
        """Return the lights as seen from the hits."""
        return Illumination(self.world, self._lit_surfaces())

    @property
    def _dark(self) -> bool:
        """Return whether there is no light or nothing to light, so that nothing about it needs computing."""
        return not (self.scene.shapes and self.scene.lights)

    @cached_property
    def exitance(self) -> list[Any]:
        """Return M [W/m^2]."""
        if self._dark:
            return [self.types.Vector(0)] * self.lanes.tile
        return [
            self._leaving(one.albedo, arriving) for one, arriving in zip(self.surfaces, self.irradiance, strict=True)
        ]

    @property
    def irradiance(self) -> list[Any]:
        """Return E [W/m^2]."""
        return self.illumination.irradiance

    def _leaving(self, albedo: Any, irradiance: Any) -> Any:
        leaving = self.configuration["exitance"](albedo, irradiance)
        if all(channel > 0 for shape in self.scene.shapes for channel in shape.albedo):
            return leaving
        # Under an irradiance that overflowed, black stays black: 0 times infinity would be no number.
        return dr.select((albedo == 0) & dr.isinf(irradiance), 0, leaving)

    @cached_property
    def radiance(self) -> list[Any]:
        """Return L [W/(m^2 sr)]."""
        if self._dark:
            return [self.types.Vector(0)] * self.lanes.tile
        formula = self.configuration["radiance_simplified" if self.scene.shading == "simplified" else "radiance"]
        pairs = zip(self.surfaces, self.exitance, strict=True)
        return [dr.select(surfaces.hidden, 0, formula(exitance)) for surfaces, exitance in pairs]

    @property
    def radiance_alone(self) -> list[Any]:
        """Return L [W/(m^2 sr)] for who asks for nothing else; packets that hit nothing are not shaded."""
        if self._dark:
            return self.radiance
        some = reduced(operator.or_, [hit.distance < dr.inf for hit in self.hits])
        # What is computed inside is of no use outside: a copy keeps it.
        inside, nothing = copy(self), [self.types.Vector(0)] * self.lanes.tile
        return where(some, lambda: inside.radiance, nothing)

    def channels(self, stage: Stage) -> list[tuple[Any, ...]]:
        """Return the channels of an image stage, with the specification's values where nothing was hit."""
        Float = self.types.Float
        match stage:
            case Stage.RAY:
                return [tuple(ray.direction) for ray in self.rays]
            case Stage.OBJECT:
                return [(one.hit.shape, one.hit.face) for one in self.surfaces]
            case Stage.DISTANCE:
                return [(one.hit.distance,) for one in self.surfaces]
            case Stage.POSITION:
                return [tuple(dr.select(one.mask, one.position, 0)) for one in self.surfaces]
            case Stage.NORMAL:
                return [tuple(one.normal) for one in self.surfaces]
            case Stage.VISIBILITY:
                lit = self.illumination.lit
                return [tuple(dr.select(light[k], Float(1), 0) for light in lit) for k in range(self.lanes.tile)]
            case Stage.IRRADIANCE:
                return [tuple(irradiance) for irradiance in self.irradiance]
            case Stage.EXITANCE:
                return [tuple(exitance) for exitance in self.exitance]
            case Stage.RADIANCE:
                return [tuple(radiance) for radiance in self.radiance]
            case _:
                raise ValueError(f"{stage} is not an image")
