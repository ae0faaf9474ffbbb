"""The task of a law: the subject renders the law's scenes, small, and the relation is judged.

A law asks for the images of several scenes, so that its worker renders them itself, as the subject's own worker does.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

from rayproof.cases.laws import LAWS
from rayproof.cases.laws.relations import lit_from_the_eye
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Resolution, Stage, StageImages
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.laws import Judged, LawReport, judge
from rayproof.reports.run.messages import LawTask

KEPT = 64  # scenes of which the answers are remembered
SIDES = (41, 31)  # px, at most: odd, so that there is a central pixel


class UnansweredError(Exception):
    """A scene that the subject says it cannot draw; the message is its reason."""


class SubjectError(Exception):
    """A scene at which the subject failed: it crashed, or wrote nothing that could be read."""


class Asked:
    """A renderer as laws ask it. It remembers what it answered, and how precise and how coarse that was."""

    def __init__(self, render: Callable[[Scene], Answers]) -> None:
        self._render = render
        self._kept: dict[Scene, StageImages] = {}
        self.precision = "float32"
        self.resolutions: dict[Stage, Resolution] = {}

    def __call__(self, scene: Scene) -> StageImages:
        """Return the stages that the subject answers.

        Raises:
            UnansweredError: it says that it cannot draw the scene.
            SubjectError: it failed.

        """
        if scene in self._kept:
            return self._kept[scene]
        drawn = self._render(scene)
        if drawn.error is not None:
            raise SubjectError(drawn.error)
        if not drawn.answers:
            raise UnansweredError(next(iter(drawn.unsupported.values()), "It answers no stage."))
        self.precision = drawn.precision
        self.resolutions.update(drawn.resolutions)
        if len(self._kept) >= KEPT:
            self._kept.pop(next(iter(self._kept)))
        self._kept[scene] = drawn.answers
        return drawn.answers


def small(scene: Scene) -> Scene:
    """Return the scene in a small image, since a law holds for any size, and lit, since else nothing is radiant."""
    if not scene.lights:
        scene = lit_from_the_eye(scene)
    width, height = min(scene.camera.width, SIDES[0]), min(scene.camera.height, SIDES[1])
    return replace(scene, camera=replace(scene.camera, width=width, height=height))


def check_law(law: str, scene: Scene, ask: Asked, configuration: str) -> LawReport:
    """Return what becomes of one law on one case's scene."""
    judged: list[Judged] = []
    try:
        for relation in LAWS[law](small(scene), ask):
            judged.append(judge(relation, ask.precision, ask.resolutions.get(relation.stage)))
    except UnansweredError as reason:
        return LawReport(law=law, configuration=configuration, unsupported=str(reason))
    except SubjectError as problem:
        return LawReport(law=law, configuration=configuration, error=str(problem))
    return LawReport(law=law, configuration=configuration, judged=tuple(judged))


def law_worker(handler: Callable[[str], Callable[[Any], Any]]) -> Callable[[LawTask], LawReport]:
    """Return what does tasks, with the work of other kinds by `handler`; it remembers what was answered last."""
    work, last = cache(handler), dict[Any, Asked]()

    def put(task: LawTask) -> LawReport:
        key = (task.kind, task.task)
        if key not in last:
            last.clear()
            last[key] = Asked(lambda scene: work(task.kind)(replace(task.task, scene=scene))[0])
        return check_law(task.law, task.task.scene, last[key], task.configuration)

    return put
