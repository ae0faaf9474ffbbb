"""What workers do: render with a tracer configuration, render with a reference, judge a case."""

from collections.abc import Callable
from typing import Any

from cases.answers import Answers
from cases.stages import Stage
from reports.judge.oracle import stages_of
from reports.judge.parties import Candidate, Witness
from reports.judge.supersampled import finer
from reports.run.llvm import choose_packaged_llvm
from reports.run.orders import ReferenceTask, TracerTask


def handler(kind: str) -> Callable[[Any], Any]:
    """Return the function that does a worker's tasks; its imports are made here, once, in the worker."""
    choose_packaged_llvm()
    if kind == "tracer":
        return _trace
    if kind == "judge":
        from reports.run.judge_task import judge

        return judge
    return _refer(kind.removeprefix("reference:"))


def _trace(task: TracerTask) -> tuple[Candidate, dict[str, str]]:
    """Render by the tracer."""
    from reports.run.clearances import shadow_epsilons
    from tracer.configuration import Configuration
    from tracer.render import render
    from tracer.versions import versions

    configuration = Configuration.parse(task.configuration)
    answers = render(task.scene, stages_of(task.scene), configuration)
    fine = None
    if task.samples > 1:
        fine = render(finer(task.scene, task.samples), stages_of(task.scene), configuration)
    candidate = Candidate(
        name=configuration.name,
        precision=configuration.precision,
        items=configuration.items,
        shadow_epsilon=shadow_epsilons(task.scene, answers, configuration),
        answers=answers,
        fine=fine,
    )
    return candidate, versions()


def _refer(name: str) -> Callable[[ReferenceTask], tuple[Witness, dict[str, str]]]:
    """Return the task of one reference."""
    from reference import REFERENCES

    reference = REFERENCES[name]()
    independent = bool(REFERENCES.about(name).get("independent", False))

    def refer(task: ReferenceTask) -> tuple[Witness, dict[str, str]]:
        stages = stages_of(task.scene)
        unsupported = {stage: why for stage in stages if (why := reference.unsupported(task.scene, stage)) is not None}
        asked = tuple(stage for stage in stages if stage not in unsupported)
        answers: Answers = reference.render(task.scene, asked) if asked else {}
        mean = None
        if task.samples > 1 and Stage.RADIANCE in asked:
            mean = reference.render(task.scene, (Stage.RADIANCE,), samples=task.samples)[Stage.RADIANCE]
        notes = getattr(reference, "notes", None)
        epsilon = getattr(reference, "epsilon_at", None) if Stage.POSITION in answers else None
        witness = Witness(
            name=name,
            precision=reference.precision,
            independent=independent,
            shadow_epsilon=epsilon(answers) if epsilon is not None else 0.0,
            answers={stage: answers[stage] for stage in asked if stage in answers},
            unsupported=unsupported,
            notes=tuple(notes(task.scene)) if notes is not None else (),
            mean=mean,
        )
        return witness, {name: reference.version()}

    return refer
