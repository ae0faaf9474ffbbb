"""Stage truth for many pixels: what was received is filtered, asked in balls, and where that fails asked exactly."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from flint import arb, ctx

from rayproof.cases.scene import Scene
from rayproof.cases.stages import FACTS, Stage, exr_channels
from rayproof.reference.certified.exact_numbers import Algebraic
from rayproof.reference.certified.fields import MOST, START, UndecidedError
from rayproof.reference.certified.filters.suspects import hits_along, lights_from, surfaces_of
from rayproof.reference.certified.stage_of_pixel import STEPS, Given, Suspected, surface_of
from rayproof.reference.certified.truths import BEFORE_EXACT, narrow, rounded
from rayproof.reference.certified.worlds import Worlds


def continued(scene: Scene, stage: Stage, given: Mapping[Stage, np.ndarray]) -> np.ndarray:
    """Return a stage (N, channels) from the given rows of the stages that it reads.

    A row with a number that is not finite gives NaN; of a miss, or of an object that the scene lacks, the miss's value.
    """
    reads = STEPS[stage][1]
    rows = [{name: given[name][row].tolist() for name in reads} for row in range(len(given[reads[0]]))]
    channels = len(exr_channels(stage, lights=len(scene.lights)))
    miss: Any = FACTS[stage].miss
    surfaces = frozenset(surfaces_of(scene))
    answers = np.full((len(rows), channels), float(miss))
    asked: list[int] = []
    for number, row in enumerate(rows):
        if Stage.OBJECT in row and not _exists(row, surfaces):
            continue
        if stage is Stage.POSITION and not math.isfinite(row[Stage.DISTANCE][0]):
            continue
        if stage is Stage.OBJECT and not any(row[Stage.RAY]):
            continue
        if all(math.isfinite(value) for values in row.values() for value in values):
            asked.append(number)
        elif stage in {Stage.OBJECT, Stage.VISIBILITY}:
            continue  # no comparison with NaN is true
        else:
            answers[number] = _not_finite(scene, stage, row)
    worlds = Worlds(scene)
    before = ctx.prec
    try:
        for number, suspected in zip(asked, _suspected(scene, stage, given, asked), strict=True):
            answers[number] = _answer(worlds, stage, rows[number], suspected)
    finally:
        ctx.prec = before
    return answers


def _exists(row: Given, surfaces: frozenset[tuple[int, int]]) -> bool:
    return all(math.isfinite(value) for value in row[Stage.OBJECT]) and surface_of(row) in surfaces


def _not_finite(scene: Scene, stage: Stage, row: Given) -> list[float]:
    """Return what an overflow makes of itself where the stage only scales it, else NaN."""
    if stage is Stage.EXITANCE:
        albedo = scene.shapes[surface_of(row)[0]].albedo
        return [factor * value if factor else 0.0 for factor, value in zip(albedo, row[Stage.IRRADIANCE], strict=True)]
    if stage is Stage.RADIANCE and all(math.isfinite(value) for value in row[Stage.RAY] + row[Stage.NORMAL]):
        seen = radiates(row)
        return [value if seen else 0.0 for value in row[Stage.EXITANCE]]
    return [math.nan] * len(exr_channels(stage, lights=len(scene.lights)))


def radiates(row: Given) -> bool:
    """Return whether the given normal looks against the given direction, exactly."""
    ctx.prec = MOST
    return bool(sum((arb(n) * arb(d) for n, d in zip(row[Stage.NORMAL], row[Stage.RAY], strict=True)), arb(0)) < 0)


def _suspected(scene: Scene, stage: Stage, given: Mapping[Stage, np.ndarray], asked: list[int]) -> Sequence[Suspected]:
    if stage is Stage.OBJECT:
        return [[surfaces] for surfaces in hits_along(scene, given[Stage.RAY][asked])]
    if stage is Stage.VISIBILITY:
        return lights_from(scene, given[Stage.POSITION][asked], given[Stage.OBJECT][asked])
    return [()] * len(asked)


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
