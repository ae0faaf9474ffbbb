"""`Sides`: the oracle's answers at points just around an edge pixel's centre.

An edge pixel may differ from the oracle's centre value only if it has the value of a side: the object must be one
that the oracle meets within the edge's reach, and a distance or normal must lie where that object's do.
"""

import itertools
import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from rayproof.cases.scene import Plane, Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import all_of, any_of

DIRECTIONS = 12
# Just beyond the reach, at it and at half of it: an edge within reach is crossed by at least one of the circles.
RADII = (0.5, 1.0, 2.0)
SAMPLES = 1 + DIRECTIONS * len(RADII)
HALVINGS = 12  # towards an outline values change as the root of the distance: these leave 1.6 % of the change
# Of what samples span, so much farther a value may lie: between two of the directions, on a surface that is straight
# in the image, the least cosine to either is 0.97, and between two circles a bend hides a sixteenth of what it spans.
SPARE = 1 / 8


class Oracle(Protocol):
    """The questions of the judge to the analytic reference here."""

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
    spare: float = SPARE  # how far beyond the samples a value may lie, as a share of what they span
    endless: tuple[int, ...] = ()  # shapes that have a horizon

    def at(self, where: np.ndarray) -> "Sides":
        """Return the same of the pixels of `where` (height, width) alone."""
        kept = where[self.rows, self.columns]
        answers = {stage: image[kept] for stage, image in self.answers.items()}
        return replace(self, rows=self.rows[kept], columns=self.columns[kept], answers=answers)


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
        endless=tuple(index for index, shape in enumerate(scene.shapes) if isinstance(shape, Plane)),
    )


def with_ends(around: Sides, oracle: Oracle, scene: Scene, where: np.ndarray, reach: np.ndarray) -> Sides:
    """Return the sides at the pixels of `where`, with samples more: where along each direction what is seen changes.

    Towards an outline a value changes as the root of the distance, so that the samples do not tell how far it goes.
    """
    around = around.at(where)
    rows, columns, answers = around.rows, around.columns, dict(around.answers)
    paths = np.array([[0, *(1 + circle * DIRECTIONS + k for circle in range(len(RADII)))] for k in range(DIRECTIONS)])
    seen = answers[Stage.OBJECT][:, paths]
    pixel, direction, step = np.nonzero(any_of(seen[:, :, 1:] != seen[:, :, :-1]))
    if not len(pixel):
        return around
    before, circles = seen[pixel, direction, step], np.array([0.0, *RADII])
    centres = np.stack([columns[pixel] + 0.5, rows[pixel] + 0.5], axis=-1)
    turns = direction * (2 * math.pi / DIRECTIONS)
    steps = np.stack([np.cos(turns), np.sin(turns)], axis=-1) * radius_of(reach[rows, columns])[pixel][:, np.newaxis]
    inner, outer = circles[step], circles[step + 1]
    for _ in range(HALVINGS):
        middle = (inner + outer) / 2
        met = oracle.at(scene, (Stage.OBJECT,), centres + steps * middle[:, np.newaxis])[Stage.OBJECT]
        same = all_of(met == before)
        inner, outer = np.where(same, middle, inner), np.where(same, outer, middle)
    slot, points = direction * len(RADII) + step, centres + steps * np.stack([inner, outer])[..., np.newaxis]
    found = oracle.at(scene, tuple(answers), points.reshape(-1, 2))
    for stage, image in answers.items():
        more = np.repeat(image[:, :1], 2 * (SAMPLES - 1), axis=1)
        more[pixel, np.stack([slot, slot + SAMPLES - 1])] = found[stage].reshape(2, len(pixel), -1)
        answers[stage] = np.concatenate([image, more], axis=1)
    return replace(around, answers=answers)


def radius_of(reach: np.ndarray) -> np.ndarray:
    """Return how far [px] around a pixel's centre its sides are looked for, of edges within `reach` [px]."""
    # Never past the neighbouring pixel's centre: beyond it a value is a neighbour's, not a side's.
    return np.minimum(np.maximum(reach, 1e-9), 0.5)


def with_twins(
    around: Sides, oracle: Oracle, scene: Scene, truth: StageImages, ours: StageImages, depth: np.ndarray, count: int
) -> Sides:
    """Return the sides with `count` samples more: the object that was answered, where it lies as deep as what is seen.

    Of surfaces that coincide the oracle names one and rounding another, and of two faces of a mesh that meet at its
    outline the one that is turned away. What the oracle says of that other one is another value that an edge pixel may
    have, if the two are no farther apart than `depth` [m] along the ray of one of the first `count` samples.
    """
    rows, columns = around.rows, around.columns
    differ = np.flatnonzero(any_of(ours[Stage.OBJECT] != truth[Stage.OBJECT])[rows, columns])
    if not len(differ):
        return around
    named = np.repeat(ours[Stage.OBJECT][rows[differ], columns[differ], np.newaxis], count, axis=1)
    given = {Stage.RAY: around.answers[Stage.RAY][differ, :count], Stage.OBJECT: named}
    asked = replace(scene, camera=replace(scene.camera, height=len(differ), width=count))  # rays are given
    for stage in (Stage.DISTANCE, Stage.POSITION, Stage.NORMAL):
        given[stage] = oracle.continue_from(asked, stage, given)
    with np.errstate(invalid="ignore"):
        apart = np.abs(given[Stage.DISTANCE] - around.answers[Stage.DISTANCE][differ, :count])
    twin = apart <= depth[rows[differ], columns[differ], np.newaxis, np.newaxis]
    answers = {}
    for stage, samples in around.answers.items():
        more = np.repeat(samples[:, :1], count, axis=1)
        more[differ] = np.where(twin, given[stage], more[differ])
        answers[stage] = np.concatenate([samples, more], axis=1)
    return replace(around, answers=answers)


def with_both_sides_of_the_eye(
    around: Sides, oracle: Oracle, scene: Scene, truth: StageImages, at_eye: np.ndarray
) -> Sides:
    """Return the sides with rows more: what an eye sees that stands to either side of the surfaces that hold it.

    Without clipping such a surface is before the eye or behind it by rounding, in each ray by itself. `at_eye`
    (shapes,) [m] is by how much. Of the corners of a cube about the eye one at least lies that far off to each side.
    They tell what is seen. Its place follows from the eye's own ray, or is the eye if that ray misses the near side.
    """
    rows, columns, camera, near = around.rows, around.columns, scene.camera, np.zeros((*truth[Stage.RAY].shape[:2], 1))
    centres = np.stack([columns + 0.5, rows + 0.5], axis=-1)
    answers, seen = dict(around.answers), np.full((*truth[Stage.RAY].shape[:2], 2), -1.0)
    for corner in itertools.product((-2 * at_eye.max(), 2 * at_eye.max()), repeat=3):
        eye, target = (tuple(map(float, np.add(point, corner))) for point in (camera.eye, camera.target))
        aside = replace(scene, camera=replace(camera, eye=eye, target=target))
        met = oracle.at(aside, (Stage.OBJECT, Stage.DISTANCE), centres)
        seen[rows, columns], near[rows, columns] = met[Stage.OBJECT], met[Stage.DISTANCE]
        given = {Stage.RAY: truth[Stage.RAY], Stage.OBJECT: seen}
        distance = oracle.continue_from(scene, Stage.DISTANCE, given)
        here = np.isin(seen[..., :1], np.flatnonzero(at_eye)) & ~(distance <= 2 * near)
        given[Stage.DISTANCE] = np.where(here, 0.0, distance)
        for stage in (Stage.POSITION, Stage.NORMAL):
            given[stage] = oracle.continue_from(scene, stage, given)
        # One row for each, or any distance between the near and the far side of one shape would pass.
        for stage, samples in around.answers.items():
            more = np.repeat(given[stage][rows, columns][:, np.newaxis], samples.shape[1], axis=1)
            answers[stage] = np.concatenate([answers[stage], more])
    rows, columns = (np.tile(pixels, 1 + 2**3) for pixels in (rows, columns))
    return replace(around, rows=rows, columns=columns, answers=answers)


def with_what_is_behind(
    around: Sides, oracle: Oracle, scene: Scene, close: np.ndarray, reach: np.ndarray, depth: np.ndarray
) -> Sides:
    """Return the sides with as many samples more: what lies behind the shape that is seen, where it is as `close`.

    Where an outline is hidden by rounding alone; and for renderers that do not say which of two coinciding surfaces
    they saw. Two faces of one mesh are as close where they meet; what lies behind the mesh is a side only if it is no
    farther than `depth` [m] from what is seen.
    """
    rows, columns = around.rows, around.columns
    asked = close[rows, columns]
    if not asked.any():
        return around
    answers = {stage: np.concatenate([old, *[old[:, :1]] * SAMPLES], axis=1) for stage, old in around.answers.items()}
    front = around.answers[Stage.OBJECT][:, 0, 0]
    for index in np.unique(front[asked & (front >= 0)]).astype(int):
        here = np.flatnonzero(asked & (front == index))
        without = replace(scene, shapes=(*scene.shapes[:index], *scene.shapes[index + 1 :]))
        where = np.zeros(close.shape, dtype=bool)
        where[rows[here], columns[here]] = True
        behind = sides(oracle, without, tuple(answers), where, reach).answers
        with np.errstate(invalid="ignore"):
            apart = np.abs(behind[Stage.DISTANCE] - around.answers[Stage.DISTANCE][here, :SAMPLES])
        kept = apart <= depth[rows[here], columns[here], np.newaxis, np.newaxis]
        for stage, image in behind.items():
            # Numbers of shapes count on where one is gone.
            moved = np.where(image[..., :1] >= index, [1.0, 0.0], 0.0) if stage is Stage.OBJECT else 0.0
            answers[stage][here, -SAMPLES:] = np.where(kept, image + moved, answers[stage][here, -SAMPLES:])
    return replace(around, answers=answers)
