"""Renders a scene, judges it with the oracle, and returns its first failure, which can be compared with another one."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from scipy.ndimage import uniform_filter

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.judge.verdict import Judged, items_to_blame
from rayproof.reports.results.case_records import Check, Measurement
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.scenes import case_of_scene
from rayproof.reports.run.worker_tasks import kind_of, prepare, render_reference, render_subject
from rayproof.reports.subjects import Subject
from rayproof.tracer.configuration import Configuration

AROUND = 5  # px, side of the window in which the failing neighbours of a pixel are counted
MOST_PIXELS = 4  # failing pixels at which the camera is aimed

Renderer = Callable[[Scene], Answers]


class Way(StrEnum):
    """The kind of a wrong value."""

    NUMBER = "no number"
    HIT = "wrong hit"
    VALUE = "wrong value"


@dataclass(frozen=True, kw_only=True)
class SceneFailure:
    """The first failure in a scene."""

    stage: Stage
    way: Way
    items: frozenset[str]  # items of the specification that the subject may break
    reason: str  # the judge's sentence
    limit: float  # limit of the worst pixel
    error: float  # error of the worst pixel
    pixels: tuple[tuple[int, int], ...]  # (column, row), worst first; empty if only many pixels together are wrong
    answers: StageImages = field(repr=False)
    truth: StageImages = field(repr=False)

    def same(self, smaller: "SceneFailure") -> bool:
        """Return whether `smaller`, the failure of a smaller scene, is the same failure.

        It may have fewer items, since a scene without cubes, for example, cannot break the item on cubes.
        """
        return (
            (self.stage, self.way) == (smaller.stage, smaller.way)
            and bool(smaller.items)
            and smaller.items <= self.items
        )

    def seen(self, *images: StageImages) -> set[tuple[int, int]]:
        """Return the (shape, face) in the images at the worst failing pixel, or at all pixels if there is none."""
        hit: set[tuple[int, int]] = set()
        for image in images or (self.answers, self.truth):
            if Stage.OBJECT not in image:
                continue
            objects = image[Stage.OBJECT]
            shown = [objects[row, column] for column, row in self.pixels[:1]] or objects.reshape(-1, objects.shape[-1])
            hit |= {(int(shape), int(face)) for shape, face in shown if math.isfinite(shape) and shape >= 0}
        return hit


def renderer(subject: Subject, configuration: Configuration) -> Renderer:
    """Return a function that renders a scene with the subject in this process; `configuration` is the tracer's."""
    prepare(kind_of(subject))
    if subject.is_tracer:
        from rayproof.reports.run.tracer_task import trace

        return lambda scene: trace(scene, configuration.name).answers
    return lambda scene: render_subject(scene, 1, subject).answers


def judged(scene: Scene, render: Renderer) -> tuple[Judged, Answers, StageImages] | None:
    """Return the verdict with the oracle as the only reference, the subject's images and the oracle's.

    Return None if the subject has no images.
    """
    oracle = Analytic()
    try:
        subject = render(scene)
    except ValueError:  # the scene exceeds the range of the subject's precision
        return None
    if subject.error is not None:
        return None
    case = case_of_scene(scene, name="shrink/scene", stresses="A scene on its way to the smallest one.")
    with np.errstate(all="ignore"):  # reduced scenes may be unusual, and the subject's values may be arbitrary
        truth = render_reference(ORACLE, scene).answers
        return judge_case(case, [subject], [truth], oracle, {}), subject, truth.answers


def failure(scene: Scene, render: Renderer, stage: Stage | None = None) -> SceneFailure | None:
    """Return the first failure in a scene, or the failure at `stage`; None if the subject agrees with the oracle."""
    answered = judged(scene, render)
    if answered is None:
        return None
    verdict, subject, truth = answered
    order = list(Stage)
    failed = [check for check in verdict.checks if check.outcome is Outcome.FAIL and stage in (None, check.stage)]
    guilty = min(failed, key=lambda check: (not check.alone, order.index(check.stage), -check.ratio), default=None)
    if guilty is None:
        return None
    items = verdict.blamed
    if guilty.stage is not verdict.stage:
        checks = [(check.stage.value, check.outcome.value) for check in verdict.checks]
        items = items_to_blame(guilty.stage, checks, [type(shape).__name__ for shape in scene.shapes], subject.items)
    measured = _measured(guilty)
    numbers = (None, None) if measured is None else (measured.limit, measured.worst_error)
    limit, error = (math.nan if number is None else number for number in numbers)
    return SceneFailure(
        stage=guilty.stage,
        way=_way(guilty.stage, measured),
        items=frozenset(items),
        reason=guilty.reason,
        limit=limit,
        error=error,
        pixels=() if measured is None else _pixels(measured),
        answers=subject.answers,
        truth=truth,
    )


def _measured(check: Check) -> Measurement | None:
    """Return the measurement that makes a check fail, if possible from the previous stages; None for the camera."""
    if check.continued is not None and not check.continued.worst_ratio <= 1:
        return check.continued
    return check.end_to_end


def _way(stage: Stage, measured: Measurement | None) -> Way:
    if measured is None:
        return Way.VALUE
    missed = [not math.isfinite(number) for number in measured.ours]
    if stage is Stage.OBJECT or (
        stage is Stage.DISTANCE and missed != [math.isinf(number) for number in measured.theirs]
    ):
        return Way.NUMBER if any(map(math.isnan, measured.ours)) else Way.HIT
    right = [not math.isfinite(number) for number in measured.theirs]
    return Way.NUMBER if missed != right else Way.VALUE


def _pixels(measured: Measurement) -> tuple[tuple[int, int], ...]:
    """Return failing pixels: the worst, the pixel with the most failing neighbours, the middle and the first."""
    wrong = measured.kinds == Kind.WRONG
    rows, columns = np.nonzero(wrong)
    if measured.worst_ratio <= 1 or not len(rows):
        return ()
    neighbours = uniform_filter(wrong.astype(np.float64), size=AROUND, mode="constant")[rows, columns]
    chosen = (int(np.argmax(neighbours)), len(rows) // 2, 0)
    places = [measured.pixel, *((int(columns[index]), int(rows[index])) for index in chosen)]
    return tuple(dict.fromkeys(place for place in places if place is not None))[:MOST_PIXELS]
