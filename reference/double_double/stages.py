"""Each stage in pairs from the stages before it, one lane a ray."""

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Camera, Scene
from rayproof.cases.stages import Stage, exr_channels
from rayproof.reference.double_double.arithmetic import (
    Bool,
    Pair,
    Questions,
    cross,
    fractions,
    inverse_sqrt,
    only_where,
    root,
    select,
    tangent,
)
from rayproof.reference.double_double.arithmetic import dot as exact_dot
from rayproof.reference.double_double.arithmetic import minus as exact_minus
from rayproof.reference.double_double.shapes import PairCrossing, PairSpan, Seen
from rayproof.reference.double_double.vectors import Vector, pair_dot, pair_minus, plus, scaled, terms, unit
from rayproof.reference.double_double.worlds import EYE, Ball, PairWorld

Rows = dict[Stage, list[Any]]  # per channel a Pair; of OBJECT two Int32, of VISIBILITY Bools


def rays(world: PairWorld, px: Any, py: Any) -> list[Any]:
    """Return unit directions through image points [px]."""
    return list(unit(world.frame.direction(px, py)))


def _vector(values: list[Any]) -> Vector:
    return (values[0], values[1], values[2])


def objects(world: PairWorld, rows: Rows, ask: Questions) -> list[Any]:
    """Return shape and face of the nearest hit, and t as a third entry; -1 on a miss. Equal t: the lower index."""
    ray, types = _vector(rows[Stage.RAY]), world.types
    span = world.clip(ray)
    width = dr.width(ray[0].high)
    shape, face = dr.full(types.Int32, -1, width), dr.full(types.Int32, -1, width)
    best, everywhere = Pair(types.Float64(dr.inf), types.Float64(0)), types.Bool(True)
    for index in range(len(world.scene.shapes)):
        found = _crossing(world.seen(index, EYE), ray, span, ask, everywhere)
        both = found.hit & (shape >= 0)
        nearer = found.hit & ((shape < 0) | ask.is_less(found.t, best, both))
        shape, face = dr.select(nearer, index, shape), dr.select(nearer, found.face, face)
        best = select(nearer, found.t, best)
    return [shape, face, best]


def distances(world: PairWorld, rows: Rows, ask: Questions) -> list[Any]:
    """Return t of the first crossing with the given shape and face inside the clip interval, inf without [m]."""
    ray = _vector(rows[Stage.RAY])
    span, types = world.clip(ray), world.types
    shape, face = rows[Stage.OBJECT][:2]
    answer = Pair(types.Float64(dr.inf), types.Float64(0))
    for index in range(len(world.scene.shapes)):
        mine = shape == index
        found = _crossing(world.seen(index, EYE), ray, span, ask, mine, only=face)
        answer = select(mine & found.hit, found.t, answer)
    return [answer]


def positions(world: PairWorld, rows: Rows, ask: Questions) -> list[Any]:
    """Return eye + t d [m], 0 on a miss."""
    del ask
    t = rows[Stage.DISTANCE][0]
    hit = (rows[Stage.OBJECT][0] >= 0) & dr.isfinite(t.high)
    point = plus(world.points[EYE], scaled(_vector(rows[Stage.RAY]), t))
    return [select(hit, part, _zero(world)) for part in point]


def normals(world: PairWorld, rows: Rows, ask: Questions) -> list[Any]:
    """Return unit shading normals, turned towards the viewer on two-sided shapes, 0 on a miss."""
    ray = _vector(rows[Stage.RAY])
    segment = pair_minus(_vector(rows[Stage.POSITION]), world.points[EYE])
    shape, face = rows[Stage.OBJECT][:2]
    answer, turns = (_zero(world), _zero(world), _zero(world)), world.types.Bool(False)
    for index, kind in enumerate(world.scene.shapes):
        mine = shape == index
        seen, _ = world.seen(index, EYE)
        outward = seen.normal(segment, face, ask, mine)
        x, y, z = (select(mine, part, other) for part, other in zip(outward, answer, strict=True))
        answer = (x, y, z)
        turns |= mine & kind.two_sided
    away = ask.is_positive(pair_dot(answer, ray), terms(answer, ray), turns) & turns
    return [select(away, -part, part) for part in answer]


def visibility(world: PairWorld, rows: Rows, ask: Questions) -> list[Any]:
    """Return per light whether it is above the horizon and the open segment to it is free (LIT-1)."""
    shape, face = rows[Stage.OBJECT][:2]
    position, normal = _vector(rows[Stage.POSITION]), _vector(rows[Stage.NORMAL])
    answers: list[Bool] = []
    for light in range(len(world.scene.lights)):
        segment = pair_minus(position, world.points[light])
        hit = shape >= 0
        free = hit & ask.is_positive(-pair_dot(normal, segment), terms(normal, segment), hit)
        one = Pair(world.types.Float64(1), world.types.Float64(0))
        between = PairSpan(low=None, high=one, speed=None)
        for index in range(len(world.scene.shapes)):
            mine = shape == index
            seen, _ = world.seen(index, light)
            itself = mine & free
            free &= ~(itself & seen.blocks_itself(segment, ask, itself))
            # A convex shape was just asked about itself; of a mesh the other faces are blockers like any.
            asked = free & ~mine if seen.is_convex else free
            own = dr.select(mine, face, -1)
            free &= ~_crossing(world.seen(index, light), segment, between, ask, asked, without=own).hit
        answers.append(free)
    return answers


def irradiance(world: PairWorld, rows: Rows, ask: Questions) -> list[Any]:
    """Return E [W/m^2] per channel, the sum over visible lights (RAD-1 to RAD-3)."""
    position, normal = _vector(rows[Stage.POSITION]), _vector(rows[Stage.NORMAL])
    total = [_zero(world)] * 3
    for light, visible in enumerate(rows[Stage.VISIBILITY]):
        segment = pair_minus(world.points[light], position)
        square = pair_dot(segment, segment)
        lambert = pair_dot(normal, segment)
        lit = visible & ask.is_positive(lambert, terms(normal, segment), visible) & (rows[Stage.OBJECT][0] >= 0)
        inverse = inverse_sqrt(square)
        factor = lambert * inverse
        if world.scene.shading != "simplified":
            factor = factor * inverse * inverse
        for channel, strength in enumerate(world.strengths[light]):
            if strength is not None:
                part = select(lit, strength * factor, _zero(world))
                total[channel] = total[channel] + part
    return total


def exitance(world: PairWorld, rows: Rows, ask: Questions) -> list[Any]:
    """Return M = albedo E [W/m^2]."""
    del ask
    shape, types = rows[Stage.OBJECT][0], world.types
    # The last entry is what a miss reflects.
    index = dr.select(shape >= 0, shape, len(world.scene.shapes))
    albedos = [Pair(dr.gather(types.Float64, table, index), types.Float64(0)) for table in world.albedos]
    return [albedo * part for albedo, part in zip(albedos, rows[Stage.IRRADIANCE], strict=True)]


def radiance(world: PairWorld, rows: Rows, ask: Questions) -> list[Any]:
    """Return L [W/(m^2 sr)], 0 where the shading normal does not look at the viewer (RAD-4)."""
    ray, normal = _vector(rows[Stage.RAY]), _vector(rows[Stage.NORMAL])
    hit = rows[Stage.OBJECT][0] >= 0
    seen = hit & ask.is_positive(-pair_dot(normal, ray), terms(normal, ray), hit)
    leaving = rows[Stage.EXITANCE]
    if world.scene.shading != "simplified":
        leaving = [value * world.inverse_pi for value in leaving]
    return [select(seen, value, _zero(world)) for value in leaving]


def _crossing(
    seen: tuple[Seen, Ball | None], ray: Vector, span: PairSpan, ask: Questions, asked: Bool, **faces: Any
) -> PairCrossing:
    """Return the first crossing that counts, asked in pairs only of packets that come near the shape."""
    shape, ball = seen
    near = asked if ball is None else asked & ball.may_be_met(ray, span)

    def work(inner: Questions) -> list[Any]:
        found = shape.crossing(ray, span, inner, near, **faces)
        return [found.t, found.hit, found.face]

    return PairCrossing(*only_where(near, ask, work))


def _zero(world: PairWorld) -> Pair:
    return Pair(world.types.Float64(0), world.types.Float64(0))


# In the specification's order; each reads only stages above it.
NEXT: dict[Stage, Callable[[PairWorld, Rows, Questions], list[Any]]] = {
    Stage.OBJECT: objects,
    Stage.DISTANCE: distances,
    Stage.POSITION: positions,
    Stage.NORMAL: normals,
    Stage.VISIBILITY: visibility,
    Stage.IRRADIANCE: irradiance,
    Stage.EXITANCE: exitance,
    Stage.RADIANCE: radiance,
}


# The camera stage from exact fractions, each number rounded once (CAM-1 to CAM-3).


def camera_answer(camera: Camera) -> dict[str, np.ndarray]:
    """Return the dictionary of `cases.stages` for `Stage.CAMERA`."""
    eye = fractions(camera.eye)
    forward = exact_minus(fractions(camera.target), eye)
    right = cross(forward, fractions(camera.up))
    F = [part / root(exact_dot(forward, forward)) for part in forward]
    R = [part / root(exact_dot(right, right)) for part in right]
    U = list(cross(R, F))
    tall = tangent(Fraction(camera.fovy) / 2)
    wide = tall * camera.width / camera.height
    near, far = Fraction(camera.near), Fraction(camera.far)
    slope = far / (far - near)
    columns = [Fraction(2 * column + 1, camera.width) - 1 for column in range(camera.width)]
    rows = [1 - Fraction(2 * row + 1, camera.height) for row in range(camera.height)]
    down, across = np.mgrid[: camera.height, : camera.width]
    return {
        "view": _floats([*([*axis, -exact_dot(axis, eye)] for axis in (R, U, F)), [0, 0, 0, 1]]),
        "view_inverse": _floats([*([R[k], U[k], F[k], eye[k]] for k in range(3)), [0, 0, 0, 1]]),
        "projection": _floats([[1 / wide, 0, 0, 0], [0, 1 / tall, 0, 0], [0, 0, slope, -near * slope], [0, 0, 1, 0]]),
        "projection_inverse": _floats(
            [[wide, 0, 0, 0], [0, tall, 0, 0], [0, 0, 0, 1], [0, 0, -1 / (near * slope), 1 / near]]
        ),
        "frustum_corners": _floats(
            [
                [eye[k] + depth * (F[k] + sx * wide * R[k] + sy * tall * U[k]) for k in range(3)]
                for depth in (near, far)
                for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
            ]
        ),
        "ndc": np.stack(np.meshgrid([float(x) for x in columns], [float(y) for y in rows]), axis=-1),
        "pixel": np.stack([across + 0.5, down + 0.5], axis=-1),
    }


def _floats(values: list[Any]) -> np.ndarray:
    return np.array([[float(value) for value in row] for row in values])


# From arrays to Dr.Jit and back, all stages of many rays in one kernel.


Rounded = dict[Stage, np.ndarray]


def launch(
    world: PairWorld, stages: Sequence[Stage], points: np.ndarray, *, pairs: bool
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
    world, ask = PairWorld(scene, types), Questions(types.Float64)
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


def _fetch(
    world: PairWorld, rows: Rows, ask: Questions, count: int, *, pairs: bool
) -> tuple[Rounded, Rounded, np.ndarray]:
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
