"""From arrays to Dr.Jit and back, all stages of many rays in one kernel."""

from collections.abc import Mapping, Sequence
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, exr_channels
from rayproof.reference.double_double.pair_arithmetic import Pair
from rayproof.reference.double_double.questions import Questions
from rayproof.reference.double_double.stages import NEXT, Rows, rays
from rayproof.reference.double_double.worlds import World

Rounded = dict[Stage, np.ndarray]


def launch(
    world: World, stages: Sequence[Stage], points: np.ndarray, *, pairs: bool
) -> tuple[Rounded, Rounded, np.ndarray]:
    """Return stages at image points (N, 2) [px] in high and, with `pairs`, low parts, and the margins (N,)."""
    types = world.types
    ask = Questions(types.Float64)
    columns = np.ascontiguousarray(points.T)
    rows: Rows = {Stage.RAY: rays(world, types.Float64(columns[0]), types.Float64(columns[1]))}
    if stages[-1] is not Stage.RAY:
        *rows[Stage.OBJECT], nearest = NEXT[Stage.OBJECT](world, rows, ask)
        rows[Stage.DISTANCE] = [nearest]
        order = list(NEXT)
        for stage in order[2 : order.index(stages[-1]) + 1]:
            rows[stage] = NEXT[stage](world, rows, ask)
    return _fetch(world, {stage: rows[stage] for stage in stages}, ask, len(points), pairs=pairs)


def step(scene: Scene, types: Any, stage: Stage, given: Mapping[Stage, np.ndarray]) -> np.ndarray:
    """Return one stage (N, channels) from the given rows of the stages before it."""
    world, ask = World(scene, types), Questions(types.Float64)
    rows: Rows = {}
    for name, values in given.items():
        columns = [types.Float64(np.ascontiguousarray(column)) for column in values.T]
        if name is Stage.OBJECT:
            rows[name] = [types.Int32(column) for column in columns]
        elif name is Stage.VISIBILITY:
            rows[name] = [column > 0 for column in columns]
        else:
            rows[name] = [Pair(column, dr.zeros(types.Float64, len(values))) for column in columns]
    channels = len(exr_channels(stage, lights=len(scene.lights)))
    found = {stage: NEXT[stage](world, rows, ask)[:channels]}
    answer = _fetch(world, found, ask, len(next(iter(given.values()))), pairs=False)[0][stage]
    if stage in {Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE, Stage.NORMAL}:
        return np.where(given[Stage.OBJECT][:, :1] >= 0, answer, 0.0)
    return answer


def _fetch(world: World, rows: Rows, ask: Questions, count: int, *, pairs: bool) -> tuple[Rounded, Rounded, np.ndarray]:
    float64 = world.types.Float64
    high = {stage: [float64(_high(value)) for value in values] for stage, values in rows.items()}
    low = {stage: [float64(_low(value)) for value in values] for stage, values in rows.items()} if pairs else {}
    margin = ask.least if pairs else float64(dr.nan)
    dr.eval(high, low, margin)

    def table(values: Sequence[Any]) -> np.ndarray:
        rows = [np.broadcast_to(np.asarray(value), count) for value in values]
        return np.stack(rows).T if rows else np.empty((count, 0))

    return (
        {stage: table(values) for stage, values in high.items()},
        {stage: table(values) for stage, values in low.items()},
        table([margin])[:, 0],
    )


def _high(value: Any) -> Any:
    return value.high if isinstance(value, Pair) else value


def _low(value: Any) -> Any:
    return value.low if isinstance(value, Pair) else 0
