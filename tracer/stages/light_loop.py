"""Many lights, one after the other in a loop of the kernel: its length does not depend on how many there are."""

from functools import cached_property
from typing import Any, Protocol

import drjit as dr
import numpy as np

from rayproof.cases.scene import Scene
from rayproof.tracer.device.arrays import ArrayTypes
from rayproof.tracer.device.buffers import DeviceBuffers
from rayproof.tracer.stages.intersector import World
from rayproof.tracer.stages.surfaces import Surfaces


class Lighting(Protocol):
    """What the loop asks of `tracer.stages.illumination.Illumination`."""

    world: World
    scene: Scene
    types: ArrayTypes
    surfaces: Any  # a sequence of Surfaces
    configuration: Any

    def one(self, position: Any, flux: Any) -> tuple[list[Any], list[Any]]:
        """Return where one light is seen, and what it brings."""
        ...

    def settle(self) -> None:
        """Compute what does not depend on the light."""
        ...


class LightLoop:
    """The lights of a scene by a loop."""

    def __init__(self, lighting: Lighting) -> None:
        self._lighting, self.types = lighting, lighting.types
        self._rays = len(lighting.surfaces)
        first: Surfaces = lighting.surfaces[0]
        self._width = dr.width(first.hit.distance)

    def _numbers(self, name: str, values: list[tuple[float, float, float]]) -> Any:
        buffers: DeviceBuffers = self._lighting.world.buffers
        return buffers.floats(f"lights' {name}", self.types, lambda: np.array(values))

    def _loop(self, seen: Any) -> list[Any]:
        """Return the irradiance per ray; write 1 into `seen`, unless None, where a light is seen."""
        types, lighting, lights = self.types, self._lighting, self._lighting.scene.lights
        positions = self._numbers("positions", [light.position for light in lights])
        fluxes = self._numbers("fluxes", [light.flux for light in lights])
        lane = dr.arange(types.UInt, self._width)
        add = lighting.configuration["sum_lights"]
        lighting.settle()

        def step(index: Any, total: Any) -> tuple[Any, Any]:
            position, flux = (dr.gather(types.Vector, numbers, index) for numbers in (positions, fluxes))
            lit, brought = lighting.one(position, flux)
            if seen is not None:
                for k, one in enumerate(lit):
                    where = (index * self._rays + k) * self._width + lane
                    dr.scatter(seen, dr.select(one, types.Float(1), 0), where, mode=dr.ReduceMode.Permute)
            return index + 1, [add(list(pair)) for pair in zip(total, brought, strict=True)]

        count = len(lights)
        _, total = dr.while_loop(
            state=(dr.zeros(types.UInt, self._width), [dr.zeros(types.Vector, self._width) for _ in range(self._rays)]),
            cond=lambda index, total: index < count,
            body=step,
            labels=("index", "total"),
        )
        return list(total)

    @cached_property
    def irradiance(self) -> list[Any]:
        """Return E [W/m^2] per ray."""
        return self._loop(None)

    def lit(self) -> list[list[Any]]:
        """Return, per light, where it is seen, per ray; evaluates the loop."""
        lights = len(self._lighting.scene.lights)
        seen = dr.zeros(self.types.Float, lights * self._rays * self._width)
        # Asked for together, so that the loop runs once.
        self.__dict__["irradiance"] = self._loop(seen)
        dr.eval(seen, self.irradiance)
        found = np.array(seen).reshape(lights, self._rays, self._width) > 0
        return [[self.types.Bool(ray) for ray in light] for light in found]
