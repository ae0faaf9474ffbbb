"""What each kind of worker does with a task: tracer, reference, recalled answers, a program, the judge."""

import atexit
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rayproof.cases.case import ITEMS_OF_OTHERS
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Reference, Stage, StageImages
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.run import reference_cache as cache
from rayproof.reports.run.cache_store import DamagedEntryError
from rayproof.reports.run.messages import (
    JUDGE,
    RECALLING,
    TRACING,
    UNDER_TEST,
    QuestionTask,
    RecallTask,
    ReferenceTask,
    SubjectTask,
)
from rayproof.reports.run.reference_cache import Question, Rendered, damage
from rayproof.reports.subjects import FUNCTION, PROGRAM, SERVED, Subject
from rayproof.tracer.kernel.compiler import choose_packaged_llvm


def ask_reference(name: str, reference: Reference, task: ReferenceTask, *, independent: bool) -> Answers:
    """Return a reference's answers to a task's scene with all that it declares, or an error if it is not installed."""
    question, unsupported = _question(name, reference, task)
    missing = _ability(reference, "missing")
    if missing is not None and (why := missing()) is not None:
        about = {"name": name, "precision": reference.precision, "independent": independent}
        return Answers(**about, unsupported=unsupported, error=why)
    found = _rendered(question, task)
    return _witness(question, found, unsupported, independent=independent)


def recalled(name: str, reference: Reference, task: ReferenceTask, *, independent: bool) -> Answers | None:
    """Return what `heard` would, if nothing needs rendering for it; None if something does.

    Raises:
        DamagedEntryError: it was kept, and is not what was written.

    """
    question, unsupported = _question(name, reference, task)
    found = cache.recalled(question) if question.stages else Rendered(answers={}, mean=None, cached=False)
    return None if found is None else _witness(question, found, unsupported, independent=independent)


def unable(reference: Reference, scene: Scene, stage: Stage) -> str | None:
    """Return why a reference cannot answer a stage of a scene, or None."""
    if any(scene.camera.sample_offset) and not getattr(reference, "takes_sample_offset", False):
        return "Its rays pass through the pixels' centres."
    return reference.unsupported(scene, stage)


def _question(name: str, reference: Reference, task: ReferenceTask) -> tuple[Question, dict[Stage, str]]:
    """Return what the reference is asked, and why it is not asked about the other stages."""
    scene, stages = task.scene, stages_of(task.scene)
    unsupported = {stage: why for stage in stages if (why := unable(reference, scene, stage)) is not None}
    asked = tuple(stage for stage in stages if stage not in unsupported)
    question = Question(name=name, reference=reference, scene=scene, stages=asked, samples=task.samples)
    return question, unsupported


def _witness(question: Question, found: Rendered, unsupported: dict[Stage, str], *, independent: bool) -> Answers:
    reference, scene, answers = question.reference, question.scene, found.answers
    notes, settings = _ability(reference, "notes"), _ability(reference, "settings")
    resolution = _ability(reference, "resolution")
    coarse = {stage: resolution(scene, stage) for stage in question.stages} if resolution is not None else {}
    return Answers(
        name=question.name,
        precision=reference.precision,
        independent=independent,
        chained=False,
        shadow_epsilon=_shadow_epsilon(reference, scene, answers),
        answers={stage: answers[stage] for stage in question.stages if stage in answers},
        unsupported=unsupported,
        notes=tuple(notes(scene)) if notes is not None else (),
        mishaps=found.notes,
        mean=found.mean,
        cached=found.cached,
        settings=dict(settings(scene)) if settings is not None else {},
        resolutions={stage: one for stage, one in coarse.items() if one is not None},
        ray_epsilon=float(getattr(reference, "ray_epsilon", 0.0)),
        light_epsilon=float(getattr(reference, "light_epsilon", 0.0)),
        edge_epsilon=float(beyond(scene)) if (beyond := _ability(reference, "edge_epsilon")) is not None else 0.0,
        tie_epsilon=float(apart(scene)) if (apart := _ability(reference, "tie_epsilon")) is not None else 0.0,
    )


def _rendered(question: Question, task: ReferenceTask) -> Rendered:
    """Return the reference's images, from the cache where the task allows it."""

    def render() -> tuple[StageImages, np.ndarray | None]:
        reference, asked = question.reference, question.stages
        answers: StageImages = reference.render(task.scene, asked) if asked else {}
        mean = None
        if task.samples > 1 and Stage.RADIANCE in asked:
            mean = reference.render(task.scene, (Stage.RADIANCE,), samples=task.samples)[Stage.RADIANCE]
        return answers, mean

    if task.cached and question.stages:
        return cache.cached(question, render)
    answers, mean = render()
    return Rendered(answers=answers, mean=mean, cached=False)


def put_to_test(answers: Answers) -> Answers:
    """Return a reference's answers as those of the one under test."""
    return replace(answers, items=ITEMS_OF_OTHERS, independent=False, chained=False, cached=False, mishaps=())


def _shadow_epsilon(reference: Reference, scene: Scene, answers: StageImages) -> float | np.ndarray:
    """Return the shadow epsilon [m] of a reference, one number or (height, width); 0 if it declares none."""
    if Stage.POSITION not in answers:
        return 0.0
    of_scene, of_answers = _ability(reference, "epsilon_in"), _ability(reference, "epsilon_at")
    if of_scene is not None:
        return of_scene(scene, answers)
    return of_answers(answers) if of_answers is not None else 0.0


def _ability(reference: Reference, name: str) -> Any:
    """Return one of the methods that a reference may have (reference/__init__.py lists them), or None."""
    return getattr(reference, name, None)


def handler(kind: str) -> Callable[[Any], Any]:
    """Return the function that does a worker's tasks; its imports are made here, once, in the worker."""
    choose_packaged_llvm()
    if kind == TRACING:
        from rayproof.reports.run.tracer_task import prepare, trace

        prepare()
        return trace
    if kind == JUDGE:
        from rayproof.reports.run.judge_task import do

        return do
    if kind == RECALLING:
        return _recall
    if kind in (PROGRAM, SERVED, FUNCTION):
        return _program()
    if kind.startswith(UNDER_TEST):
        return _tested(kind.removeprefix(UNDER_TEST))
    return _refer(kind.removeprefix("reference:"))


def _refer(name: str) -> Callable[[ReferenceTask], tuple[Answers, dict[str, str]]]:
    """Return the task of one reference."""
    from rayproof.reference import REFERENCES

    reference = REFERENCES[name]()
    independent = bool(REFERENCES.about(name).get("independent", False))

    def refer(task: ReferenceTask) -> tuple[Answers, dict[str, str]]:
        answers = ask_reference(name, reference, task, independent=independent)
        return answers, {} if answers.error is not None else {name: reference.version()}

    return refer


def _recall(task: RecallTask) -> tuple[dict[str, tuple[Answers, str]], dict[str, str]]:
    """Return what the cache knows, and what is to be told of entries that were damaged.

    One worker asks it for all references, none of which need start for it.
    """
    from rayproof.reference import REFERENCES

    found, damaged = {}, {}
    for name in task.names:
        reference = REFERENCES[name]()
        independent = bool(REFERENCES.about(name).get("independent", False))
        try:
            answers = recalled(name, reference, task.task, independent=independent)
        except DamagedEntryError as wrong:
            damaged[name] = damage(wrong)
            continue
        except (ImportError, OSError, RuntimeError):  # it does not start, as its own worker will report
            continue
        if answers is not None:
            found[name] = (answers, reference.version())
    return found, damaged


def _tested(name: str) -> Callable[[SubjectTask], tuple[Answers, dict[str, str], tuple[str, ...]]]:
    """Return the task of a reference under test; nothing of it is taken from a cache."""
    from rayproof.reference import REFERENCES

    reference = REFERENCES[name]()

    def test(task: SubjectTask) -> tuple[Answers, dict[str, str], tuple[str, ...]]:
        asked = ReferenceTask(scene=task.scene, samples=task.samples)
        answers = ask_reference(name, reference, asked, independent=False)
        return put_to_test(answers), {} if answers.error is not None else {name: reference.version()}, answers.notes

    return test


def _program() -> Callable[[SubjectTask | QuestionTask], Any]:
    """Return the task of a user's program, which renders or says what it can; one that stays alive is started once."""
    from rayproof.reports.subjects.program import ask_capabilities, ask_program, notes_on
    from rayproof.reports.subjects.serving import Server

    kept: list[Server] = []

    def server(subject: Subject) -> Server | None:
        if not subject.stays:
            return None
        if not kept:
            kept.append(Server(subject))
            atexit.register(kept[0].close)
        kept[0].subject = subject
        return kept[0]

    def run_program(task: SubjectTask | QuestionTask) -> Any:
        subject = task.subject
        if isinstance(task, QuestionTask):
            stays = server(subject)
            try:
                found = ask_capabilities(subject, seconds=task.seconds, server=stays)
                if stays is not None:
                    stays.standing()  # its start is no part of the first case
                return found
            except ValueError as wrong:
                return str(wrong)
        able, stays = subject.capabilities, server(subject)
        # A run's environment names Python's own version, too.
        who = "function" if subject.transport == FUNCTION else subject.name
        versions = {who: f"{able.title} ({able.precision}, written as float32)"}
        answered = ask_program(subject, task.scene, samples=task.samples, keep=task.keep, server=stays)
        notes = notes_on(subject, task.scene)
        if stays is not None:
            return answered, versions, (*notes, *stays.notes()), stays.standing()
        return answered, versions, notes

    return run_program
