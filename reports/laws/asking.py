"""Putting scenes to the subject under test, for a law: each scene once, and only the stages to be looked at."""

from collections.abc import Callable, Collection
from typing import Any

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Resolution, Stage, StageImages
from rayproof.reports.judge.answers import Candidate
from rayproof.reports.run.messages import SubjectTask, TracerTask
from rayproof.reports.run.tasks.handlers import handler
from rayproof.reports.run.tasks.kinds import TRACING, UNDER_TEST
from rayproof.reports.subjects import PROGRAM, Subject

KEPT = 64  # scenes of which the answers are remembered

Render = Callable[[Scene], Candidate]


class UnansweredError(Exception):
    """A scene that the subject says it cannot draw; the message is its reason."""


class SubjectError(Exception):
    """A scene at which the subject failed: it crashed, or wrote nothing that could be read."""


def renderer(subject: Subject, configuration: str) -> Render:
    """Return what renders a scene by the subject; of the tracer by one of its configurations."""
    if subject.is_tracer:
        trace = handler(TRACING)
        return lambda scene: trace(TracerTask(scene=scene, configuration=configuration, samples=1))[0]
    test = handler(PROGRAM if subject.name == PROGRAM else f"{UNDER_TEST}{subject.name}")
    return lambda scene: test(SubjectTask(scene=scene, samples=1, case="law", subject=subject))[0]


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
        if drawn.error is not None or drawn.answers is None:
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
