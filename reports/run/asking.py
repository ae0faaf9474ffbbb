"""Asking a reference: what it answers to a scene, as a witness or as the one under test."""

from typing import Any

import numpy as np

from cases.answers import Answers, Reference
from cases.scene import Scene
from cases.stages import Stage
from reports.judge.oracle import stages_of
from reports.judge.parties import Candidate, Witness
from reports.run.orders import ReferenceTask
from reports.run.reference_cache import Rendered, cached
from reports.subjects import ITEMS_OF_OTHERS


def heard(name: str, reference: Reference, task: ReferenceTask, *, independent: bool) -> Witness:
    """Return a reference's answers to a task's scene, with all that it says of them."""
    scene, stages = task.scene, stages_of(task.scene)
    unsupported = {stage: why for stage in stages if (why := reference.unsupported(scene, stage)) is not None}
    asked = tuple(stage for stage in stages if stage not in unsupported)
    found = _rendered(name, reference, task, asked)
    answers = found.answers
    notes, settings = _ability(reference, "notes"), _ability(reference, "settings")
    resolution = _ability(reference, "resolution")
    coarse = {stage: resolution(scene, stage) for stage in asked} if resolution is not None else {}
    return Witness(
        name=name,
        precision=reference.precision,
        independent=independent,
        shadow_epsilon=_shadow_epsilon(reference, scene, answers),
        answers={stage: answers[stage] for stage in asked if stage in answers},
        unsupported=unsupported,
        notes=(*(notes(scene) if notes is not None else ()), *found.notes),
        mean=found.mean,
        cached=found.cached,
        settings=dict(settings(scene)) if settings is not None else {},
        resolutions={stage: one for stage, one in coarse.items() if one is not None},
        ray_epsilon=float(getattr(reference, "ray_epsilon", 0.0)),
    )


def _rendered(name: str, reference: Reference, task: ReferenceTask, asked: tuple[Stage, ...]) -> Rendered:
    """Return the reference's images, from the cache where the task allows it."""

    def render() -> tuple[Answers, np.ndarray | None]:
        answers: Answers = reference.render(task.scene, asked) if asked else {}
        mean = None
        if task.samples > 1 and Stage.RADIANCE in asked:
            mean = reference.render(task.scene, (Stage.RADIANCE,), samples=task.samples)[Stage.RADIANCE]
        return answers, mean

    if task.cached and asked:
        return cached(name, reference, task.scene, asked, task.samples, render)
    answers, mean = render()
    return Rendered(answers=answers, mean=mean, cached=False)


def put_to_test(witness: Witness) -> Candidate:
    """Return a reference's answers as those of the one under test."""
    return Candidate(
        name=witness.name,
        precision=witness.precision,
        items=ITEMS_OF_OTHERS,
        shadow_epsilon=witness.shadow_epsilon,
        answers=witness.answers,
        mean=witness.mean,
        unsupported=witness.unsupported,
        resolutions=witness.resolutions,
        ray_epsilon=witness.ray_epsilon,
        chained=False,
    )


def _shadow_epsilon(reference: Reference, scene: Scene, answers: Answers) -> float | np.ndarray:
    """Return what a reference ignores at a feeler's start [m], one number or (height, width); 0 if it does not say."""
    if Stage.POSITION not in answers:
        return 0.0
    of_scene, of_answers = _ability(reference, "epsilon_in"), _ability(reference, "epsilon_at")
    if of_scene is not None:
        return of_scene(scene, answers)
    return of_answers(answers) if of_answers is not None else 0.0


def _ability(reference: Reference, name: str) -> Any:
    """Return one of the methods that a reference may have (reference/__init__.py lists them), or None."""
    return getattr(reference, name, None)
