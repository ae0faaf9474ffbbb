"""From pixel to radiance: every stage computed when it is first asked for, and not before."""

from functools import cached_property
from typing import Any

import drjit as dr

from cases.scene import Scene
from cases.stages import Stage
from tracer.arrays import array_types
from tracer.configuration import Configuration
from tracer.frame import Frame
from tracer.illumination import Illumination
from tracer.rays import Interval, Ray
from tracer.surfaces import Surfaces
from tracer.world import World


class Trace:
    """One scene by one configuration; the stages are unevaluated Dr.Jit arrays, one entry per sample, row by row."""

    def __init__(self, scene: Scene, configuration: Configuration, *, per_side: int) -> None:
        self.scene, self.configuration, self.per_side = scene, configuration, per_side
        self.types = array_types(configuration.precision)
        self.frame = Frame(camera=scene.camera, configuration=configuration, types=self.types)

    @cached_property
    def ndc(self) -> tuple[Any, Any]:
        """Return (sx, sy) of every sample."""
        camera = self.scene.camera
        columns = camera.width * self.per_side
        index = dr.arange(self.types.UInt, columns * camera.height * self.per_side)
        row = index // columns
        column = index - row * columns
        Float = self.types.Float
        px, py = self.configuration["sample"](Float(column), Float(row), self.per_side)
        return self.configuration["ndc"](px, py, camera.width, camera.height)

    @cached_property
    def ray(self) -> Ray:
        """Return the camera rays, with unit directions."""
        return Ray(origin=self.frame.eye, direction=self.configuration["ray"](self.frame, *self.ndc))

    @cached_property
    def surfaces(self) -> Surfaces:
        """Return the nearest hits of the camera rays."""
        clip = self.configuration[f"clip_{self.scene.clip}"]
        near, far = clip(self.ray.direction, self.frame.forward, self.frame.near, self.frame.far)
        world = World(self.scene, self.configuration, self.types)
        hit = world.nearest(self.ray, Interval(nearest=near, farthest=far))
        return Surfaces(world, self.ray, hit, eye=self.frame.eye)

    @cached_property
    def illumination(self) -> Illumination:
        """Return the lights as seen from the hits."""
        return Illumination(self.surfaces)

    @property
    def _dark(self) -> bool:
        """Return whether there is no light or nothing to light, so that nothing about it needs computing."""
        return not (self.scene.shapes and self.scene.lights)

    @cached_property
    def exitance(self) -> Any:
        """Return M [W/m^2]."""
        if self._dark:
            return self.types.Vector(0)
        albedo, irradiance = self.surfaces.albedo, self.illumination.irradiance
        leaving = self.configuration["exitance"](albedo, irradiance)
        if all(channel > 0 for shape in self.scene.shapes for channel in shape.albedo):
            return leaving
        # Under an irradiance that overflowed, black stays black: 0 times infinity would be no number.
        return dr.select((albedo == 0) & dr.isinf(irradiance), 0, leaving)

    @cached_property
    def radiance(self) -> Any:
        """Return L [W/(m^2 sr)]."""
        if self._dark:
            return self.types.Vector(0)
        slot = "radiance_simplified" if self.scene.shading == "simplified" else "radiance"
        return dr.select(self.surfaces.hidden, 0, self.configuration[slot](self.exitance))

    def channels(self, stage: Stage) -> tuple[Any, ...]:
        """Return the channels of an image stage, with the specification's values where nothing was hit."""
        Float, hit = self.types.Float, self.surfaces.hit if stage is not Stage.RAY else None
        match stage:
            case Stage.RAY:
                return tuple(self.ray.direction)
            case Stage.OBJECT if hit is not None:
                return hit.shape, hit.face
            case Stage.DISTANCE if hit is not None:
                return (hit.distance,)
            case Stage.POSITION:
                return tuple(dr.select(self.surfaces.mask, self.surfaces.position, 0))
            case Stage.NORMAL:
                return tuple(self.surfaces.normal)
            case Stage.VISIBILITY:
                return tuple(dr.select(lit, Float(1), 0) for lit in self.illumination.lit)
            case Stage.IRRADIANCE:
                return tuple(self.illumination.irradiance)
            case Stage.EXITANCE:
                return tuple(self.exitance)
            case Stage.RADIANCE:
                return tuple(self.radiance)
            case _:
                raise ValueError(f"{stage} is not an image")
