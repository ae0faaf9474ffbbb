"""A scene is rendered and judged by the oracle: what fails first, and whether it is the same failure."""

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

AROUND = 5  # px a side of the window in which failing neighbours of a failing pixel are counted
MOST_PIXELS = 4  # failing pixels at which the camera is aimed

Renderer = Callable[[Scene], Answers]


class Way(StrEnum):
    """How an answer is wrong."""

    NUMBER = "no number"
    HIT = "wrong hit"
    VALUE = "wrong value"


@dataclass(frozen=True, kw_only=True)
class Failure:
    """The first failure in a scene."""

    stage: Stage
    way: Way
    items: frozenset[str]  # of the specification, that may be to blame
    reason: str  # the judge's sentence
    limit: float  # of the worst pixel
    error: float
    pixels: tuple[tuple[int, int], ...]  # (column, row), worst first; none where only many pixels together are wrong
    answers: StageImages = field(repr=False)
    truth: StageImages = field(repr=False)

    def same(self, other: "Failure") -> bool:
        """Say whether `other`, of a smaller scene, is this one: a scene without cubes cannot blame the cube."""
        return (self.stage, self.way) == (other.stage, other.way) and bool(other.items) and other.items <= self.items

    def seen(self, *images: StageImages) -> set[tuple[int, int]]:
        """Return the (shape, face) that the images show at the failing pixels; in all pixels if none fails alone."""
        found: set[tuple[int, int]] = set()
        for image in images or (self.answers, self.truth):
            if Stage.OBJECT not in image:
                continue
            objects = image[Stage.OBJECT]
            shown = [objects[row, column] for column, row in self.pixels[:1]] or objects.reshape(-1, objects.shape[-1])
            found |= {(int(shape), int(face)) for shape, face in shown if math.isfinite(shape) and shape >= 0}
        return found


def renderer(subject: Subject, configuration: Configuration) -> Renderer:
    """Return how the subject is asked in this process; `configuration` is the tracer's."""
    prepare(kind_of(subject))
    if subject.is_tracer:
        from rayproof.reports.run.tracer_task import trace

        return lambda scene: trace(scene, configuration.name).answers
    return lambda scene: render_subject(scene, 1, subject).answers


def judged(scene: Scene, render: Renderer) -> tuple[Judged, Answers, StageImages] | None:
    """Return the verdict of the oracle alone, the answers and the truth; None where either has no answer."""
    oracle = Analytic()
    try:
        subject = render(scene)
    except ValueError:  # beyond what the subject's precision can hold
        return None
    if subject.error is not None:
        return None
    case = case_of_scene(scene, name="shrink/scene", stresses="A scene on its way to the smallest one.")
    with np.errstate(all="ignore"):  # of scenes that nobody made, and answers that may be anything
        truth = render_reference(ORACLE, scene).answers
        return judge_case(case, [subject], [truth], oracle, {}), subject, truth.answers


def failure(scene: Scene, render: Renderer, stage: Stage | None = None) -> Failure | None:
    """Return what fails first in a scene, or at a `stage`; None where the oracle does not blame the subject there."""
    answered = judged(scene, render)
    if answered is None:
        return None
    verdict, subject, truth = answered
    order = list(Stage)
    failed = [one for one in verdict.checks if one.outcome is Outcome.FAIL and stage in (None, one.stage)]
    guilty = min(failed, key=lambda one: (not one.alone, order.index(one.stage), -one.ratio), default=None)
    if guilty is None:
        return None
    items = verdict.blamed
    if guilty.stage is not verdict.stage:
        checks = [(one.stage.value, one.outcome.value) for one in verdict.checks]
        items = items_to_blame(guilty.stage, checks, [type(one).__name__ for one in scene.shapes], subject.items)
    measured = _measured(guilty)
    numbers = (None, None) if measured is None else (measured.limit, measured.worst_error)
    limit, error = (math.nan if number is None else number for number in numbers)
    return Failure(
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
    """Return the measurement by which a check fails: given the stages before, if by that; None of a camera."""
    if check.continued is not None and not check.continued.worst_ratio <= 1:
        return check.continued
    return check.end_to_end


def _way(stage: Stage, measured: Measurement | None) -> Way:
    if measured is None:
        return Way.VALUE
    missed = [not math.isfinite(number) for number in measured.ours]
    if stage is Stage.OBJECT or (stage is Stage.DISTANCE and missed != [math.isinf(one) for one in measured.theirs]):
        return Way.NUMBER if any(map(math.isnan, measured.ours)) else Way.HIT
    right = [not math.isfinite(number) for number in measured.theirs]
    return Way.NUMBER if missed != right else Way.VALUE


def _pixels(measured: Measurement) -> tuple[tuple[int, int], ...]:
    """Return failing pixels: the worst, the one with most failing neighbours, the first and the middle one."""
    wrong = measured.kinds == Kind.WRONG
    rows, columns = np.nonzero(wrong)
    if measured.worst_ratio <= 1 or not len(rows):
        return ()
    company = uniform_filter(wrong.astype(np.float64), size=AROUND, mode="constant")[rows, columns]
    chosen = (int(np.argmax(company)), len(rows) // 2, 0)
    places = [measured.pixel, *((int(columns[one]), int(rows[one])) for one in chosen)]
    return tuple(dict.fromkeys(place for place in places if place is not None))[:MOST_PIXELS]
