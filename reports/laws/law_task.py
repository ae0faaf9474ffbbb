"""Putting scenes to the subject under test, for a law: each scene once, and only the stages to be looked at."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.laws.relations import Relation, lit_from_the_eye
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Resolution, Stage, StageImages, exr_channels
from rayproof.reports.judge.answers import Answers
from rayproof.reports.laws.judging import Judged, judge
from rayproof.reports.processes.worker import serve
from rayproof.reports.run.messages import TRACING, SubjectTask, TracerTask, kind_of
from rayproof.reports.run.worker_tasks import handler
from rayproof.reports.subjects import Subject
from rayproof.tracer.kernel.compiler import choose_packaged_llvm

KEPT = 64  # scenes of which the answers are remembered

Render = Callable[[Scene], Answers]


class UnansweredError(Exception):
    """A scene that the subject says it cannot draw; the message is its reason."""


class SubjectError(Exception):
    """A scene at which the subject failed: it crashed, or wrote nothing that could be read."""


def renderer(subject: Subject, configuration: str) -> Render:
    """Return what renders a scene by the subject; of the tracer by one of its configurations."""
    if subject.is_tracer:
        trace = handler(TRACING)
        return lambda scene: trace(TracerTask(scene=scene, configuration=configuration, samples=1))[0]
    test = handler(kind_of(subject))
    return lambda scene: test(SubjectTask(scene=scene, samples=1, subject=subject))[0]


class Asked:
    """A renderer as laws ask it. It remembers what it answered, and how precise and how coarse that was."""

    def __init__(self, render: Render, stages: Collection[Stage]) -> None:
        self._render, self._stages = render, frozenset(stages)
        self._kept: dict[Scene, StageImages] = {}
        self.scenes = 0  # rendered
        self.precision = "float32"
        self.resolutions: dict[Stage, Resolution] = {}

    def __call__(self, scene: Scene) -> StageImages:
        """Return the stages that are to be looked at, as far as the subject answers them.

        Raises:
            UnansweredError: it says that it cannot draw the scene.
            SubjectError: it failed.

        """
        if scene in self._kept:
            return self._kept[scene]
        drawn = self._render(scene)
        self.scenes += 1
        if drawn.error is not None:
            raise SubjectError(drawn.error or "it gave no answer")
        if not drawn.answers:
            raise UnansweredError(next(iter(drawn.unsupported.values()), "It answers no stage."))
        self.precision = drawn.precision
        self.resolutions.update(drawn.resolutions)
        answers: dict[Stage, Any] = {stage: drawn.answers[stage] for stage in drawn.answers if stage in self._stages}
        if len(self._kept) >= KEPT:
            self._kept.pop(next(iter(self._kept)))
        self._kept[scene] = answers
        return answers


# What workers of `rayproof laws` are told to do, and what they report.


@dataclass(frozen=True, kw_only=True)
class LawOrder:
    """Put one law to a subject on one case's scene."""

    law: str
    case: str
    scene: Scene
    subject: Subject
    configuration: str  # of the tracer; else the subject's name
    stages: tuple[Stage, ...]  # to be looked at
    keep: bool = False  # what it takes to look at it, too


@dataclass(frozen=True, kw_only=True, eq=False)
class Exhibit:
    """One change of a scene with everything that it takes to look at it; images by stage (height, width, channels)."""

    what: str  # the change, in words
    changed: Scene
    expected: StageImages  # what the law says of it
    measured: StageImages


@dataclass(frozen=True, kw_only=True)
class LawReport:
    """What became of an order: relations judged, or the sentence that says why there are none."""

    law: str
    case: str
    configuration: str
    judged: tuple[Judged, ...] = ()
    scenes: int = 0  # rendered for it
    unsupported: str | None = None  # the subject's reason
    error: str | None = None
    exhibit: Exhibit | None = None  # of the first change that breaks the law, else of the first

    @property
    def alarms(self) -> tuple[Judged, ...]:
        """Return the relations that are broken."""
        return tuple(one for one in self.judged if one.alarm)


# One law on one case, in a worker: ask the subject, judge each relation.


SIDES = (41, 31)  # px, at most: odd, so that there is a central pixel


def serve_laws(kind: str, connection: Any) -> None:
    """Answer orders until the other end closes."""
    choose_packaged_llvm()
    serve(kind, connection, handlers=lambda _: worker())


def worker() -> Callable[[LawOrder], LawReport]:
    """Return what does orders; it remembers what the last subject answered."""
    last: dict[tuple[Any, ...], Asked] = {}

    def work(order: LawOrder) -> LawReport:
        key = (order.subject, order.configuration, order.stages)
        if key not in last:
            last.clear()
            last[key] = Asked(renderer(order.subject, order.configuration), order.stages)
        return obey(order, last[key])

    return work


def small(scene: Scene) -> Scene:
    """Return the scene in a small image, since a law holds for any size, and lit, since else nothing is radiant."""
    if not scene.lights:
        scene = lit_from_the_eye(scene)
    width, height = min(scene.camera.width, SIDES[0]), min(scene.camera.height, SIDES[1])
    return replace(scene, camera=replace(scene.camera, width=width, height=height))


def obey(order: LawOrder, ask: Asked) -> LawReport:
    """Return what becomes of one law on one case."""
    report = LawReport(law=order.law, case=order.case, configuration=order.configuration)
    before = ask.scenes
    relations: list[tuple[Relation, Judged]] = []
    try:
        for relation in LAWS[order.law](small(order.scene), ask):
            if relation.stage in order.stages:
                relations.append((relation, judge(relation, ask.precision, ask.resolutions.get(relation.stage))))
    except UnansweredError as reason:
        return replace(report, unsupported=str(reason), scenes=ask.scenes - before)
    except SubjectError as problem:
        return replace(report, error=str(problem), scenes=ask.scenes - before)
    exhibit = _exhibit(relations) if order.keep else None
    judged = tuple(one for _, one in relations)
    return replace(report, judged=judged, scenes=ask.scenes - before, exhibit=exhibit)


def _exhibit(relations: Sequence[tuple[Relation, Judged]]) -> Exhibit | None:
    """Return the first change that breaks the law, else the first of all; only images of the stages' own channels."""
    shown = [(one, judged) for one, judged in relations if one.stage is not Stage.CAMERA]
    if not shown:
        return None
    chosen = next((one for one, judged in shown if judged.alarm), shown[0][0])
    lights = len(chosen.changed.lights)
    together = {
        one.stage: one
        for one, _ in shown
        if one.what == chosen.what
        and one.expected.shape == one.measured.shape
        and one.expected.shape[:2] == chosen.expected.shape[:2]
        and one.expected.shape[2] == len(exr_channels(one.stage, lights=lights))
    }
    return Exhibit(
        what=chosen.what,
        changed=chosen.changed,
        expected={stage: np.asarray(one.expected, dtype=np.float64) for stage, one in together.items()},
        measured={stage: np.asarray(one.measured, dtype=np.float64) for stage, one in together.items()},
    )
