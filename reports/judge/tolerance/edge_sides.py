"""The two sides of an edge: what the oracle answers at points just around a pixel's centre.

An edge pixel may differ from the oracle's centre value only if it has the value of a side: the object must be one
that the oracle meets within the edge's reach, and a distance or normal must lie where that object's do.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.tolerance.channels import all_of, any_of, largest, length

DIRECTIONS = 12
# Just beyond the reach, at it and at half of it: an edge within reach is crossed by at least one of the circles.
RADII = (0.5, 1.0, 2.0)


class Oracle(Protocol):
    """What the judge asks of the analytic reference here."""

    def at(self, scene: Scene, stages: Collection[Stage], points: np.ndarray) -> StageImages:
        """Answer at image points (n, 2)."""
        ...

    def continue_from(self, scene: Scene, stage: Stage, given: StageImages) -> np.ndarray:
        """Return the stage computed from the given previous ones."""
        ...


@dataclass(frozen=True, kw_only=True)
class Sides:
    """The oracle's answers around some pixels: stage -> (pixels, samples, channels). A pixel may have several rows."""

    rows: np.ndarray
    columns: np.ndarray
    answers: dict[Stage, np.ndarray]


def sides(oracle: Oracle, scene: Scene, stages: tuple[Stage, ...], where: np.ndarray, reach: np.ndarray) -> Sides:
    """Return the oracle's answers around the pixels of `where`, within their `reach` [px]."""
    rows, columns = np.nonzero(where)
    radius = radius_of(reach[rows, columns])
    turns = [2 * math.pi * k / DIRECTIONS for k in range(DIRECTIONS)]
    offsets = np.array([(0.0, 0.0)] + [(f * math.cos(a), f * math.sin(a)) for f in RADII for a in turns])
    centres = np.stack([columns + 0.5, rows + 0.5], axis=-1)
    points = centres[:, np.newaxis] + offsets[np.newaxis] * radius[:, np.newaxis, np.newaxis]
    found = oracle.at(scene, stages, points.reshape(-1, 2)) if len(rows) else {}
    shape = (len(rows), len(offsets))
    return Sides(
        rows=rows,
        columns=columns,
        answers={stage: np.asarray(found[stage]).reshape(*shape, -1) for stage in stages if stage in found},
    )


def radius_of(reach: np.ndarray) -> np.ndarray:
    """Return how far [px] around a pixel's centre its sides are looked for, of edges within `reach` [px]."""
    # Never past the neighbouring pixel's centre: beyond it a value is a neighbour's, not a side's.
    return np.minimum(np.maximum(reach, 1e-9), 0.5)


def with_twins(
    around: Sides, oracle: Oracle, scene: Scene, truth: StageImages, ours: StageImages, depth: np.ndarray
) -> Sides:
    """Return the sides with one more sample: the object that was answered, where it lies as deep as what is seen.

    Of surfaces that coincide the oracle names one and rounding another. What the oracle says of that other one is
    another value that an edge pixel may have, if the two are no farther apart than `depth` [m].
    """
    differ = any_of(ours[Stage.OBJECT] != truth[Stage.OBJECT])
    if not np.any(differ[around.rows, around.columns]):
        return around
    asked = np.zeros(differ.shape, dtype=bool)
    asked[around.rows, around.columns] = differ[around.rows, around.columns]
    given = {Stage.RAY: truth[Stage.RAY], Stage.OBJECT: np.where(asked[..., np.newaxis], ours[Stage.OBJECT], -1.0)}
    for stage in (Stage.DISTANCE, Stage.POSITION, Stage.NORMAL):
        given[stage] = oracle.continue_from(scene, stage, given)
    with np.errstate(invalid="ignore"):
        apart = np.abs(given[Stage.DISTANCE] - truth[Stage.DISTANCE])[..., 0]
        twin = (differ & (apart <= depth))[around.rows, around.columns]
    answers = {}
    for stage, samples in around.answers.items():
        more = np.where(twin[:, np.newaxis], given[stage][around.rows, around.columns], samples[:, 0])
        answers[stage] = np.concatenate([samples, more[:, np.newaxis]], axis=1)
    return Sides(rows=around.rows, columns=around.columns, answers=answers)


def with_what_is_behind(
    around: Sides, oracle: Oracle, scene: Scene, truth: StageImages, close: np.ndarray, depth: np.ndarray
) -> Sides:
    """Return the sides with one more sample: what lies behind the shape that is seen, where it is as `close`.

    For renderers that do not say which of two coinciding surfaces they saw. Two faces of one mesh are as close where
    they meet; what lies behind the mesh is a side only if it is no farther than `depth` [m] from what is seen.
    """
    rows, columns = around.rows, around.columns
    asked = close[rows, columns]
    if not asked.any():
        return around
    answers = {stage: np.concatenate([more, more[:, :1]], axis=1) for stage, more in around.answers.items()}
    front = truth[Stage.OBJECT][rows, columns, 0]
    for index in np.unique(front[asked & (front >= 0)]).astype(int):
        here = np.flatnonzero(asked & (front == index))
        without = replace(scene, shapes=(*scene.shapes[:index], *scene.shapes[index + 1 :]))
        centres = np.stack([columns[here] + 0.5, rows[here] + 0.5], axis=-1)
        behind = oracle.at(without, tuple(answers), centres)
        with np.errstate(invalid="ignore"):
            apart = np.abs(behind[Stage.DISTANCE] - truth[Stage.DISTANCE][rows[here], columns[here]])[:, 0]
        kept = apart <= depth[rows[here], columns[here]]
        for stage, image in behind.items():
            # Numbers of shapes count on where one is gone.
            moved = np.where(image[:, :1] >= index, [[1.0, 0.0]], 0.0) if stage is Stage.OBJECT else 0.0
            answers[stage][here[kept], -1] = (image + moved)[kept]
    return Sides(rows=rows, columns=columns, answers=answers)


def widest_near(image: np.ndarray) -> np.ndarray:
    """Return each pixel's largest value within two pixels, (height, width)."""
    return _widest_of_five(_widest_of_five(image, axis=0), axis=1)


def _widest_of_five(image: np.ndarray, *, axis: int) -> np.ndarray:
    """Return each pixel's largest value within two pixels along one axis."""
    length = image.shape[axis]
    padded = np.take(image, np.clip(np.arange(-2, length + 2), 0, length - 1), axis=axis)
    near = [padded[first : first + length] if axis == 0 else padded[:, first : first + length] for first in range(5)]
    found = near[0]
    for other in near[1:]:
        found = np.maximum(found, other)
    return found


def widest_of(
    objects: np.ndarray, image: np.ndarray, own: np.ndarray, rows: np.ndarray, columns: np.ndarray
) -> np.ndarray:
    """Return at some pixels the largest value within two pixels where `objects` (height, width) is their `own` (n,).

    Where nothing nearby is, the largest of anything.
    """
    found = widest_near(image)[rows, columns]
    for index in np.unique(own):
        here = np.flatnonzero(own == index)
        same = widest_near(np.where(objects == index, image, 0.0))[rows[here], columns[here]]
        found[here] = np.where(same > 0, same, found[here])
    return found


def excused(
    stage: Stage,
    ours: StageImages,
    around: Sides,
    limit: np.ndarray,
    objects: np.ndarray,
    *,
    continued: bool,
) -> np.ndarray:
    """Return the pixels (height, width) whose value at `stage` is a side's: same object, value among that object's.

    `objects` (height, width) is the shape that the oracle sees. End to end "among" means within the samples' range,
    since a distance changes fast towards an outline. Continued from the tracer's own position a normal has no such
    freedom: it must be one of the samples'.
    """
    seen = ours[Stage.OBJECT][around.rows, around.columns]
    return _excused(stage, ours, around, limit, objects, seen, continued=continued)


def _excused(
    stage: Stage,
    ours: StageImages,
    around: Sides,
    limit: np.ndarray,
    objects: np.ndarray,
    seen: np.ndarray,
    *,
    continued: bool,
) -> np.ndarray:
    """Return the same where the renderer saw the objects `seen` (pixels, 2)."""
    good = np.zeros(objects.shape, dtype=bool)
    if not len(around.rows):
        return good
    rows, columns = around.rows, around.columns
    own = seen[:, np.newaxis]
    same = all_of(around.answers[Stage.OBJECT] == own)
    if stage is Stage.OBJECT:
        np.logical_or.at(good, (rows, columns), same.any(axis=1))
        return good
    mask = same[..., np.newaxis]
    with np.errstate(invalid="ignore"):
        theirs = around.answers[stage]
        low = np.where(mask, theirs, np.inf).min(axis=1)
        high = np.where(mask, theirs, -np.inf).max(axis=1)
        # The pixel's own limit may be that of the other side, a miss's for example: the largest of this side's holds.
        bound = largest(limit) if limit.ndim == 3 else limit
        bound = widest_of(objects, bound, own[:, 0, 0], rows, columns)[:, np.newaxis]
        # A centre that lies on the edge itself lies just outside the samples of one side: by no more than they span.
        if stage is Stage.DISTANCE:
            # Of a plane the inverse is linear in the image: towards its horizon the distance itself has no bound.
            low, high = _beyond(low, high)
        else:
            span = np.where(np.isfinite(high - low), high - low, 0.0)
            low, high = low - span, high + span
        value = ours[stage][rows, columns]
        if continued and stage is Stage.NORMAL:
            near = length(value[:, np.newaxis] - theirs) <= bound
            np.logical_or.at(good, (rows, columns), np.any(near & same, axis=1))
            return good
        inside = all_of((value >= low - bound) & (value <= high + bound)) & same.any(axis=1)
        np.logical_or.at(good, (rows, columns), inside)
    return good


def _beyond(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return distances [m] whose inverses reach as far again beyond those of a range as they span."""
    with np.errstate(divide="ignore", invalid="ignore"):
        most, least = 1 / low, 1 / high
        span = np.where(np.isfinite(low) & (low > 0), most - least, 0.0)
        return 1 / (most + span), np.where(least > span, 1 / (least - span), np.where(span > 0, np.inf, high))


def excused_anyhow(
    stage: Stage, ours: StageImages, around: Sides, limit: np.ndarray, objects: np.ndarray, *, continued: bool
) -> np.ndarray:
    """Return the same for a renderer that does not say which object it saw: any that the oracle meets there will do."""
    good = np.zeros(objects.shape, dtype=bool)
    seen = around.answers[Stage.OBJECT]
    for sample in range(seen.shape[1]):
        good |= _excused(stage, ours, around, limit, objects, seen[:, sample], continued=continued)
    return good
