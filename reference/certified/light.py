"""Irradiance, exitance and radiance of diffuse surfaces under point lights, in any field (RAD-1 to RAD-4)."""

from collections.abc import Sequence
from typing import Any

from rayproof.reference.certified.fields import Vector
from rayproof.reference.certified.vectors import dot, minus
from rayproof.reference.certified.worlds import Surface, World


def looks_at_viewer(world: World, surface: Surface, facing: int) -> bool:
    """Return whether the shading normal looks at the viewer; `facing` is the sign of n.d, n outward."""
    return facing < 0 or (facing > 0 and world.scene.shapes[surface[0]].two_sided)


def irradiance(world: World, lights: Sequence[int], position: Vector, normal: Vector) -> list[Any]:
    """Return E [W/m^2] per channel of lights that are lit, and so above the horizon (RAD-1 to RAD-3)."""
    total: list[Any] = [0, 0, 0]
    simplified = world.scene.shading == "simplified"
    for light in lights:
        segment = minus(world.points[light], position)
        inverse = world.field.rsqrt(dot(segment, segment))
        factor = dot(normal, segment) * inverse
        if not simplified:
            factor = factor * inverse * inverse
        for channel, strength in enumerate(world.strengths[light]):
            if strength is not None:
                total[channel] = strength * factor + total[channel]
    return total


def leaving(world: World, surface: Surface, arriving: list[Any], *, seen: bool) -> tuple[list[Any], list[Any]]:
    """Return M = albedo E [W/m^2], and L = M / pi [W/(m^2 sr)], or M where shading is simplified (RAD-4)."""
    exitance = [value * factor for value, factor in zip(arriving, world.albedos[surface[0]], strict=True)]
    if not seen:
        return exitance, [0, 0, 0]
    return exitance, exitance if world.scene.shading == "simplified" else [
        value * world.inverse_pi for value in exitance
    ]
