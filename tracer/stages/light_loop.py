"""Many lights, one after the other in a loop of the kernel: its length does not depend on how many there are."""

from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr
import numpy as np

from rayproof.tracer.stages.intersector import World
from rayproof.tracer.stages.surfaces import Surface

# Where one light at a position [m] of some flux [W] is seen, and the irradiance [W/m^2] that it brings, per ray.
OneLight = Callable[[Any, Any], tuple[list[Any], list[Any]]]


def _numbers(world: World, name: str, values: list[tuple[float, float, float]]) -> Any:
    return world.buffers.floats(f"lights' {name}", world.types, lambda: np.array(values))


def _loop(world: World, surfaces: Sequence[Surface], one_light: OneLight, seen: Any) -> list[Any]:
    """Return the irradiance [W/m^2] per ray; write 1 into `seen`, unless None, where a light is seen."""
    types, lights = world.types, world.scene.lights
    rays, width = len(surfaces), dr.width(surfaces[0].met.hit.distance)
    positions = _numbers(world, "positions", [light.position for light in lights])
    fluxes = _numbers(world, "fluxes", [light.flux for light in lights])
    lane = dr.arange(types.UInt, width)
    add = world.configuration["sum_lights"]

    def step(index: Any, total: Any) -> tuple[Any, Any]:
        position, flux = (dr.gather(types.Vector, numbers, index) for numbers in (positions, fluxes))
        lit, brought = one_light(position, flux)
        if seen is not None:
            for k, one in enumerate(lit):
                where = (index * rays + k) * width + lane
                dr.scatter(seen, dr.select(one, types.Float(1), 0), where, mode=dr.ReduceMode.Permute)
        return index + 1, [add(list(pair)) for pair in zip(total, brought, strict=True)]

    _, total = dr.while_loop(
        state=(dr.zeros(types.UInt, width), [dr.zeros(types.Vector, width) for _ in range(rays)]),
        cond=lambda index, total: index < len(lights),
        body=step,
        labels=("index", "total"),
    )
    return list(total)


def light_loop(
    world: World, surfaces: Sequence[Surface], one_light: OneLight, *, visibility: bool
) -> tuple[list[list[Any]], list[Any]]:
    """Return where each light is seen, per light and ray, and E [W/m^2] per ray, both from one loop over the lights.

    With `visibility` the loop is evaluated here; without it, nothing is said of where lights are seen.
    """
    if not visibility:
        return [], _loop(world, surfaces, one_light, None)
    lights, rays, width = len(world.scene.lights), len(surfaces), dr.width(surfaces[0].met.hit.distance)
    seen = dr.zeros(world.types.Float, lights * rays * width)
    irradiance = _loop(world, surfaces, one_light, seen)
    dr.eval(seen, irradiance)
    found = np.array(seen).reshape(lights, rays, width) > 0
    return [[world.types.Bool(ray) for ray in light] for light in found], irradiance
