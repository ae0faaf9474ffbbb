"""Stage truth: one stage for one pixel, exact mathematics on the very floats that were received.

Every function here works in any field, so that a tie goes to exact numbers, and returns one value per channel.
"""

from collections.abc import Callable, Sequence
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.certified.decisions import clip_window, cube_face, is_lit, nearest, outward, turned
from rayproof.reference.certified.fields import Vector
from rayproof.reference.certified.intervals import Window
from rayproof.reference.certified.light import irradiance
from rayproof.reference.certified.vectors import along, dot, minus, scaled
from rayproof.reference.certified.worlds import EYE, Surface, World

Given = dict[Stage, list[float]]  # one pixel's floats, all finite, of an object that exists
Suspected = Sequence[Sequence[Surface] | None]  # for the hit one list; for feelers one per light, None: surely blocked


def vector(world: World, values: Sequence[float]) -> Vector:
    """Return three floats in the world's field."""
    return (world.field.float(values[0]), world.field.float(values[1]), world.field.float(values[2]))


def surface_of(given: Given) -> Surface:
    """Return shape and face of the given object."""
    return int(given[Stage.OBJECT][0]), int(given[Stage.OBJECT][1])


def object_of(world: World, given: Given, suspected: Suspected) -> list[Any]:
    """Return shape and face of the first hit along the given direction."""
    direction = vector(world, given[Stage.RAY])
    window = _window(world, direction)
    found = None if window is None else nearest(world, direction, window, suspected[0] or ())
    return [-1, -1] if found is None else list(found[0][0])


def distance_of(world: World, given: Given, suspected: Suspected) -> list[Any]:
    """Return t [m] of the first crossing with the given object inside the clip interval, inf without."""
    del suspected
    direction = vector(world, given[Stage.RAY])
    window = _window(world, direction)
    found = None if window is None else world.seen(surface_of(given), EYE).crossing(direction, window)
    return [float("inf") if found is None else found[0]]


def _window(world: World, direction: Vector) -> Window | None:
    """Return where t along the given direction counts; None: nowhere, for its depth is not positive."""
    if world.scene.clip != "depth":
        return clip_window(world, None, None)
    depth = dot(direction, world.view.forward)
    return clip_window(world, None, depth) if world.field.sign(depth) > 0 else None


def position_of(world: World, given: Given, suspected: Suspected) -> list[Any]:
    """Return eye + t d [m]."""
    del suspected
    return list(along(world.points[EYE], world.field.float(given[Stage.DISTANCE][0]), vector(world, given[Stage.RAY])))


def normal_of(world: World, given: Given, suspected: Suspected) -> list[Any]:
    """Return the unit shading normal at the given position, taken to lie on its object."""
    del suspected
    surface = surface_of(given)
    segment = minus(vector(world, given[Stage.POSITION]), world.points[EYE])
    normal = outward(world, surface, cube_face(world, surface, segment), segment)
    if world.scene.shapes[surface[0]].two_sided:
        normal = turned(world, surface, normal, world.field.sign(dot(normal, vector(world, given[Stage.RAY]))))
    return list(scaled(normal, world.field.rsqrt(dot(normal, normal))))


def visibility_of(world: World, given: Given, suspected: Suspected) -> list[Any]:
    """Return per light 1 if it is above the given normal's horizon and nothing blocks it, else 0."""
    surface = surface_of(given)
    position, normal = vector(world, given[Stage.POSITION]), vector(world, given[Stage.NORMAL])
    face = cube_face(world, surface, minus(position, world.points[EYE]))
    return [
        0 if blockers is None else int(is_lit(world, light, surface, face, position, normal, blockers))
        for light, blockers in enumerate(suspected)
    ]


def irradiance_of(world: World, given: Given, suspected: Suspected) -> list[Any]:
    """Return E [W/m^2] from the lights that are given as visible and lie above the given normal's horizon."""
    del suspected
    position, normal = vector(world, given[Stage.POSITION]), vector(world, given[Stage.NORMAL])
    lights = [
        light
        for light, visible in enumerate(given[Stage.VISIBILITY])
        if visible > 0 and world.field.sign(dot(normal, minus(world.points[light], position))) > 0
    ]
    return irradiance(world, lights, position, normal)


def exitance_of(world: World, given: Given, suspected: Suspected) -> list[Any]:
    """Return M = albedo E [W/m^2]."""
    del suspected
    albedo = world.albedos[surface_of(given)[0]]
    return [factor * world.field.float(value) for factor, value in zip(albedo, given[Stage.IRRADIANCE], strict=True)]


def radiance_of(world: World, given: Given, suspected: Suspected) -> list[Any]:
    """Return L [W/(m^2 sr)], 0 where the given normal does not look at the viewer."""
    del suspected
    if world.field.sign(dot(vector(world, given[Stage.NORMAL]), vector(world, given[Stage.RAY]))) >= 0:
        return [0, 0, 0]
    leaving = [world.field.float(value) for value in given[Stage.EXITANCE]]
    return leaving if world.scene.shading == "simplified" else [value * world.inverse_pi for value in leaving]


Step = Callable[[World, Given, Suspected], list[Any]]

# Each stage's function, and the stages that it reads.
STEPS: dict[Stage, tuple[Step, tuple[Stage, ...]]] = {
    Stage.OBJECT: (object_of, (Stage.RAY,)),
    Stage.DISTANCE: (distance_of, (Stage.RAY, Stage.OBJECT)),
    Stage.POSITION: (position_of, (Stage.RAY, Stage.OBJECT, Stage.DISTANCE)),
    Stage.NORMAL: (normal_of, (Stage.RAY, Stage.OBJECT, Stage.POSITION)),
    Stage.VISIBILITY: (visibility_of, (Stage.OBJECT, Stage.POSITION, Stage.NORMAL)),
    Stage.IRRADIANCE: (irradiance_of, (Stage.OBJECT, Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY)),
    Stage.EXITANCE: (exitance_of, (Stage.OBJECT, Stage.IRRADIANCE)),
    Stage.RADIANCE: (radiance_of, (Stage.RAY, Stage.OBJECT, Stage.NORMAL, Stage.EXITANCE)),
}
