"""`Conformance`: one case inside a pytest test, which judges an answer in the same way as `rayproof run`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rayproof.cases.case import ITEMS_OF_OTHERS, Case
from rayproof.cases.rounding import PRECISIONS
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.box_filter import box_mean, finer
from rayproof.reports.judge.oracle import ORACLE, stages_of
from rayproof.reports.judge.verdict import Judged
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.case_answers import CaseAnswers
from rayproof.reports.run.worker_tasks import render_reference
from rayproof.tracer.kernel.compiler import choose_packaged_llvm

if TYPE_CHECKING:
    from rayproof.tracer.configuration import Configuration

Renderer = Callable[[Scene, Sequence[Stage]], Mapping[str, Any]]
NAME = "subject"


class Conformance:
    """A case, the references for its judgement, and the formula under test if the marker names one."""

    def __init__(
        self,
        *,
        case: Case,
        folder: Path,
        formula: str | None = None,
        configuration: str = "float32",
        stages: Sequence[str] | None = None,
        precision: str = "float32",
        witnesses: Sequence[str] = (ORACLE,),
    ) -> None:
        """Validate the marker's options; raise LookupError or ValueError for a value that does not exist."""
        from rayproof.reference import REFERENCES

        choose_packaged_llvm()
        if precision not in PRECISIONS:
            raise ValueError(f"precision must be one of {', '.join(PRECISIONS)}, got {precision!r}")
        for witness in witnesses:
            REFERENCES[witness]
        self.case = case
        self._precision = precision
        self._witnesses = tuple(dict.fromkeys((ORACLE, *witnesses)))
        self._configuration = _configuration(formula, configuration, folder)
        self._stages = tuple(map(Stage, stages)) if stages is not None else stages_of(case.scene)

    @property
    def scene(self) -> Scene:
        """Return the scene to render."""
        return self.case.scene

    @property
    def document(self) -> dict[str, Any]:
        """Return the scene as JSON data, for renderers that read scene files."""
        from rayproof.cases.scene_json import scene_to_json

        return scene_to_json(self.case.scene)

    @property
    def stages(self) -> tuple[Stage, ...]:
        """Return the stages of the scene that the renderer supports."""
        return tuple(stage for stage in stages_of(self.case.scene) if stage in self._stages)

    def check(self, answer: Renderer | Mapping[str, Any] | None = None) -> Judged:
        """Judge an answer and return its record.

        `answer` maps stage names to arrays (height, width, channels), with the channels and units of
        docs/specification.md, or is a function `(scene, stages) -> such a mapping`. By default the tracer renders the
        scene with the marker's formula.

        Raises:
            AssertionError: the case does not pass; the message names stage, formula, reference and size of the error.
            pytest.skip.Exception: none of the renderer's stages can be measured on this case.

        """
        import pytest

        judged = self.judged(answer)
        if judged.outcome in (Outcome.UNDECIDED, Outcome.UNSUPPORTED):
            pytest.skip(f"{self.case.name}: {judged.reason or 'nothing that it answers can be measured here'}")
        if judged.outcome not in (Outcome.PASS, Outcome.WARN):
            where = f" at {judged.stage}" if judged.stage else ""
            item = f" ({', '.join(judged.blamed)})" if judged.blamed else ""
            raise AssertionError(f"{self.case.name}: {judged.outcome}{where}{item}: {judged.reason}")
        return judged

    def judged(self, answer: Renderer | Mapping[str, Any] | None = None) -> Judged:
        """Judge an answer, as described at `check`, and return its record whatever the verdict.

        Raises:
            AssertionError: the answer lacks a requested stage.

        """
        from rayproof.reports.run.judge_task import verdict

        subject = self._traced() if answer is None else self._given(answer)
        renders = [render_reference(name, self.scene, self.case.samples) for name in self._witnesses]
        references = tuple(render.answers for render in renders)
        versions = {name: version for render in renders for name, version in render.versions.items()}
        return verdict(self.case, CaseAnswers(subjects=(subject,), references=references, versions=versions))

    def _traced(self) -> Answers:
        from rayproof.reports.run.tracer_task import trace

        return trace(self.scene, self._configuration.name, samples=self.case.samples).answers

    def _given(self, answer: Renderer | Mapping[str, Any]) -> Answers:
        images_by_name = answer(self.scene, self.stages) if callable(answer) else answer
        answers: StageImages = {Stage(name): value for name, value in images_by_name.items()}
        if missing := [stage for stage in self.stages if stage not in answers]:
            raise AssertionError(f"{self.case.name}: the renderer gave no {', '.join(missing)}")
        images = {
            stage: value if stage is Stage.CAMERA else np.asarray(value, dtype=np.float64)
            for stage, value in answers.items()
        }
        why = "the marker's `stages` leave it out"
        return Answers(
            name=NAME,
            precision=self._precision,
            items=ITEMS_OF_OTHERS,
            answers=images,
            mean=self._mean(answer),
            unsupported={stage: why for stage in stages_of(self.scene) if stage not in self._stages},
        )

    def _mean(self, answer: Renderer | Mapping[str, Any]) -> np.ndarray | None:
        """Return the radiance averaged over the case's samples, from a finer image; None for one sample per pixel."""
        samples = self.case.samples
        if samples == 1 or Stage.RADIANCE not in self.stages:
            return None
        if not callable(answer):
            raise AssertionError(
                f"{self.case.name}: averages {samples} x {samples} samples a pixel; give a function, "
                "which is asked for the finer image too"
            )
        fine = answer(finer(self.scene, samples), (Stage.RADIANCE,))[Stage.RADIANCE]
        return box_mean(np.asarray(fine, dtype=np.float64), samples)


def _configuration(formula: str | None, configuration: str, folder: Path) -> "Configuration":
    """Return the tracer's configuration; a formula's FILE is in the folder of the test.

    Raises:
        LookupError, ValueError: there is no such formula or configuration.

    """
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.formulas import FORMULAS
    from rayproof.tracer.formulas.own_file import MARK

    chosen = Configuration.parse(configuration)
    if formula is None:
        return chosen
    slot, _, place = formula.partition("=")
    named = FORMULAS.named(f"{slot}={folder / place}" if MARK in place else formula)
    return replace(chosen, formulas={**chosen.formulas, named.slot: named.variant})
