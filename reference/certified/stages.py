"""Stage truth in any field: one stage of one pixel, exactly, from the floats of the stages before it.

Every function here works in any field, so that exact numbers can decide a tie, and returns one value per channel.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from flint import arb, ctx

from rayproof.cases.scene import Scene
from rayproof.cases.stages import FACTS, Stage, exr_channels
from rayproof.reference.certified.fields import MOST, START, UndecidedError, Vector
from rayproof.reference.certified.filters import hits_along, lights_from, surfaces_of
from rayproof.reference.certified.light_paths import (
    clip_window,
    cube_face,
    irradiance,
    is_lit,
    nearest,
    outward,
    turned,
)
from rayproof.reference.certified.numbers import Algebraic, Window, along, dot, minus, scaled
from rayproof.reference.certified.truths import BEFORE_EXACT, narrow, rounded
from rayproof.reference.certified.worlds import EYE, ExactWorld, Surface, Worlds

Given = dict[Stage, list[float]]  # the finite floats of one pixel, whose object exists
# For the hit a single list; for shadow rays a list per light, None: surely blocked.
Suspected = Sequence[Sequence[Surface] | None]


def vector(world: ExactWorld, values: Sequence[float]) -> Vector:
    """Return three floats in the world's field."""
    return (world.field.float(values[0]), world.field.float(values[1]), world.field.float(values[2]))


def surface_of(received: Given) -> Surface:
    """Return shape and face of the pixel's object."""
    return int(received[Stage.OBJECT][0]), int(received[Stage.OBJECT][1])


def object_of(world: ExactWorld, received: Given, suspected: Suspected) -> list[Any]:
    """Return shape and face of the first hit along the given direction."""
    direction = vector(world, received[Stage.RAY])
    window = _window(world, direction)
    first_hit = None if window is None else nearest(world, direction, window, suspected[0] or ())
    return [-1, -1] if first_hit is None else list(first_hit[0][0])


def distance_of(world: ExactWorld, received: Given, suspected: Suspected) -> list[Any]:
    """Return t [m] of the first crossing with the given object inside the clip interval, inf if there is none."""
    del suspected
    direction = vector(world, received[Stage.RAY])
    window = _window(world, direction)
    crossing = None if window is None else world.seen(surface_of(received), EYE).crossing(direction, window)
    return [float("inf") if crossing is None else crossing[0]]


def _window(world: ExactWorld, direction: Vector) -> Window | None:
    """Return the interval of valid t along the given direction; None if the direction's depth is not positive."""
    if world.scene.clip != "depth":
        return clip_window(world, None, None)
    depth = dot(direction, world.view.forward)
    return clip_window(world, None, depth) if world.field.sign(depth) > 0 else None


def position_of(world: ExactWorld, received: Given, suspected: Suspected) -> list[Any]:
    """Return eye + t d [m]."""
    del suspected
    return list(
        along(world.points[EYE], world.field.float(received[Stage.DISTANCE][0]), vector(world, received[Stage.RAY]))
    )


def normal_of(world: ExactWorld, received: Given, suspected: Suspected) -> list[Any]:
    """Return the unit shading normal at the given position, which is treated as a point on its object."""
    del suspected
    surface = surface_of(received)
    segment = minus(vector(world, received[Stage.POSITION]), world.points[EYE])
    normal = outward(world, surface, cube_face(world, surface, segment), segment)
    if world.scene.shapes[surface[0]].two_sided:
        normal = turned(world, surface, normal, world.field.sign(dot(normal, vector(world, received[Stage.RAY]))))
    return list(scaled(normal, world.field.rsqrt(dot(normal, normal))))


def visibility_of(world: ExactWorld, received: Given, suspected: Suspected) -> list[Any]:
    """Return per light 1 if it is above the given normal's horizon and nothing blocks it, else 0."""
    surface = surface_of(received)
    position, normal = vector(world, received[Stage.POSITION]), vector(world, received[Stage.NORMAL])
    face = cube_face(world, surface, minus(position, world.points[EYE]))
    return [
        0 if blockers is None else int(is_lit(world, light, surface, face, position, normal, blockers))
        for light, blockers in enumerate(suspected)
    ]


def irradiance_of(world: ExactWorld, received: Given, suspected: Suspected) -> list[Any]:
    """Return E [W/m^2] from the lights that are visible and above the given normal's horizon."""
    del suspected
    position, normal = vector(world, received[Stage.POSITION]), vector(world, received[Stage.NORMAL])
    lights = [
        light
        for light, visible in enumerate(received[Stage.VISIBILITY])
        if visible > 0 and world.field.sign(dot(normal, minus(world.points[light], position))) > 0
    ]
    return irradiance(world, lights, position, normal)


def exitance_of(world: ExactWorld, received: Given, suspected: Suspected) -> list[Any]:
    """Return M = albedo E [W/m^2]."""
    del suspected
    albedo = world.albedos[surface_of(received)[0]]
    return [factor * world.field.float(value) for factor, value in zip(albedo, received[Stage.IRRADIANCE], strict=True)]


def radiance_of(world: ExactWorld, received: Given, suspected: Suspected) -> list[Any]:
    """Return L [W/(m^2 sr)], 0 if the given normal does not face the viewer."""
    del suspected
    if world.field.sign(dot(vector(world, received[Stage.NORMAL]), vector(world, received[Stage.RAY]))) >= 0:
        return [0, 0, 0]
    leaving = [world.field.float(value) for value in received[Stage.EXITANCE]]
    return leaving if world.scene.shading == "simplified" else [value * world.inverse_pi for value in leaving]


Step = Callable[[ExactWorld, Given, Suspected], list[Any]]

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


# Stage truth for many pixels: by the filter, then by balls, and for ties by exact numbers.


def continued(scene: Scene, stage: Stage, received: Mapping[Stage, np.ndarray]) -> np.ndarray:
    """Return a stage (N, channels) from the rows (N, channels) of the stages that it reads.

    A row with a number that is not finite gives NaN; a miss, or an object that the scene lacks, gives the stage's value
    for a miss.
    """
    reads = STEPS[stage][1]
    rows = [{name: received[name][row].tolist() for name in reads} for row in range(len(received[reads[0]]))]
    channels = len(exr_channels(stage, lights=len(scene.lights)))
    miss: Any = FACTS[stage].miss
    surfaces = frozenset(surfaces_of(scene))
    answers = np.full((len(rows), channels), float(miss))
    finite: list[int] = []
    for number, row in enumerate(rows):
        if Stage.OBJECT in row and not _exists(row, surfaces):
            continue
        if stage is Stage.POSITION and not math.isfinite(row[Stage.DISTANCE][0]):
            continue
        if stage is Stage.OBJECT and not any(row[Stage.RAY]):
            continue
        if all(math.isfinite(value) for values in row.values() for value in values):
            finite.append(number)
        elif stage in {Stage.OBJECT, Stage.VISIBILITY}:
            continue  # no comparison with NaN is true
        else:
            answers[number] = _not_finite(scene, stage, row)
    worlds = Worlds(scene)
    before = ctx.prec
    try:
        for number, suspected in zip(finite, _suspected(scene, stage, received, finite), strict=True):
            answers[number] = _answer(worlds, stage, rows[number], suspected)
    finally:
        ctx.prec = before
    return answers


def _exists(row: Given, surfaces: frozenset[tuple[int, int]]) -> bool:
    return all(math.isfinite(value) for value in row[Stage.OBJECT]) and surface_of(row) in surfaces


def _not_finite(scene: Scene, stage: Stage, row: Given) -> list[float]:
    """Return the scaled infinities where the stage only scales its input, else NaN."""
    if stage is Stage.EXITANCE:
        albedo = scene.shapes[surface_of(row)[0]].albedo
        return [factor * value if factor else 0.0 for factor, value in zip(albedo, row[Stage.IRRADIANCE], strict=True)]
    if stage is Stage.RADIANCE and all(math.isfinite(value) for value in row[Stage.RAY] + row[Stage.NORMAL]):
        faces_viewer = radiates(row)
        return [value if faces_viewer else 0.0 for value in row[Stage.EXITANCE]]
    return [math.nan] * len(exr_channels(stage, lights=len(scene.lights)))


def radiates(row: Given) -> bool:
    """Return whether the given normal points against the given direction, exactly."""
    ctx.prec = MOST
    return bool(sum((arb(n) * arb(d) for n, d in zip(row[Stage.NORMAL], row[Stage.RAY], strict=True)), arb(0)) < 0)


def _suspected(
    scene: Scene, stage: Stage, received: Mapping[Stage, np.ndarray], finite: list[int]
) -> Sequence[Suspected]:
    if stage is Stage.OBJECT:
        return [[surfaces] for surfaces in hits_along(scene, received[Stage.RAY][finite])]
    if stage is Stage.VISIBILITY:
        return lights_from(scene, received[Stage.POSITION][finite], received[Stage.OBJECT][finite])
    return [()] * len(finite)


def _answer(worlds: Worlds, stage: Stage, row: Given, suspected: Suspected) -> list[float]:
    step, bits = STEPS[stage][0], START
    while bits <= MOST:
        ctx.prec = bits
        try:
            values = step(worlds.balls(bits), row, suspected)
        except UndecidedError:
            if bits >= BEFORE_EXACT:
                return _exactly(worlds, stage, row, suspected)
        else:
            if bits == MOST or narrow([values], None):
                return rounded(values)
        bits *= 2
    raise AssertionError("the last precision answers")


def _exactly(worlds: Worlds, stage: Stage, row: Given, suspected: Suspected) -> list[float]:
    world = worlds.tower()
    try:
        values = STEPS[stage][0](world, row, suspected)
    except UndecidedError:
        return [math.nan] * len(exr_channels(stage, lights=len(worlds.scene.lights)))
    bits = START
    while True:
        ctx.prec = bits
        balls = [world.field.ball(value) if isinstance(value, Algebraic) else value for value in values]  # pyright: ignore[reportAttributeAccessIssue]
        if bits == MOST or narrow([balls], None):
            return rounded(balls)
        bits *= 2
