"""The tasks of workers on a case: the tracer, references, cached answers, a program, the judge.

A task is a call of a function of this module, with the case and the run's options. Each kind of worker has a name.
"""

import atexit
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rayproof.cases.case import ITEMS_OF_OTHERS, Case
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Reference, Stage, StageImages
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.results.case_records import CaseRecord, RepeatedRecord
from rayproof.reports.run import reference_cache
from rayproof.reports.run.cache_store import DamagedEntryError
from rayproof.reports.run.case_answers import CaseAnswers, Render
from rayproof.reports.run.options import CaseOptions
from rayproof.reports.run.reference_cache import ReferenceQuestion, Rendered, damage
from rayproof.reports.subjects import FUNCTION, PROGRAM, SERVED, TRACER, Subject
from rayproof.reports.subjects.protocol import Capabilities
from rayproof.tracer.kernel.compiler import choose_packaged_llvm

if TYPE_CHECKING:
    from rayproof.reports.subjects.serving import Server

# Kinds of workers. A program's kind is its transport, a reference's kind begins with REFERENCE.
JUDGE = "judge"
CACHE = "cache"
UNDER_TEST = "subject:"  # and the name of a reference that is under test
REFERENCE = "reference:"  # and its name


def kind_of(subject: Subject) -> str:
    """Return the kind of the workers that render with a subject."""
    return subject.transport or (TRACER if subject.is_tracer else f"{UNDER_TEST}{subject.name}")


def prepare(kind: str) -> None:
    """Import the modules that the tasks of a kind of worker need."""
    choose_packaged_llvm()
    if kind == TRACER:
        from rayproof.reports.run import tracer_task

        tracer_task.prepare()
    elif kind == JUDGE:
        from rayproof.reports.run import judge_task  # noqa: F401
    elif kind in (PROGRAM, SERVED, FUNCTION):
        from rayproof.reports.subjects import program, serving  # noqa: F401
    elif kind != CACHE:
        _reference(kind.removeprefix(UNDER_TEST).removeprefix(REFERENCE))


def handler(kind: str) -> Callable[[Callable[[], Any]], Any]:
    """Return the function that runs a worker's tasks, which are calls; their modules are imported here, once."""
    prepare(kind)
    return lambda task: task()


def render_tracer(case: Case, options: CaseOptions, configuration: str, launches: int = 1) -> Render:
    """Render a case with the tracer by one configuration; `launches` is how often its kernels are timed."""
    from rayproof.reports.run.tracer_task import trace, use_own_formulas

    use_own_formulas(configuration, own=options.own, copies=options.copies)
    return trace(case.scene, configuration, samples=case.samples, launches=launches)


def render_subject(scene: Scene, samples: int, subject: Subject, keep: Path | None = None) -> Render:
    """Render a scene with a reference or program under test; a program's call is kept in the folder `keep`."""
    if subject.is_program:
        return _render_program(scene, samples, subject, keep)
    render = render_reference(subject.name, scene, samples)
    return replace(render, answers=_as_subject(render.answers), notes=render.answers.notes)


def render_reference(name: str, scene: Scene, samples: int = 1, *, cached: bool = False) -> Render:
    """Render a scene with a reference; its earlier answers are taken from the cache if `cached`."""
    from rayproof.reference import REFERENCES

    independent = bool(REFERENCES.about(name).get("independent", False))
    reference = _reference(name)
    answers = ask_reference(name, reference, scene, samples=samples, cached=cached, independent=independent)
    return Render(answers=answers, versions={} if answers.error is not None else {name: reference.version()})


def cached_references(case: Case, options: CaseOptions) -> tuple[dict[str, Render], dict[str, str]]:
    """Return the references' cached answers to a case, and a sentence for each damaged entry.

    One worker does this for all references, so that their own workers need not start.
    """
    from rayproof.reference import REFERENCES

    renders, damaged = {}, {}
    for name in options.references:
        independent = bool(REFERENCES.about(name).get("independent", False))
        try:
            reference = _reference(name)
            answers = cached_answers(name, reference, case.scene, samples=case.samples, independent=independent)
        except DamagedEntryError as wrong:
            damaged[name] = damage(wrong)
            continue
        except (ImportError, OSError, RuntimeError):  # it does not start, as its own worker will report
            continue
        if answers is not None:
            renders[name] = Render(answers=answers, versions={name: reference.version()})
    return renders, damaged


def judge(case: Case, options: CaseOptions, answers: CaseAnswers, folder: Path) -> CaseRecord:
    """Judge a case, write its images and scene below `folder`, and return its record."""
    from rayproof.reports.run.judge_task import judge

    return judge(case, options, answers, folder)


def check_judge(*, cached: bool) -> None:
    """Run the judge's self-tests, unless they passed before; a pass is stored in the cache if `cached`."""
    from rayproof.reports.run.judge_task import check_judge

    check_judge(cached=cached)


def compare_repeated(case: Case, first: Answers, again: Answers, *, varies: bool) -> RepeatedRecord:
    """Compare a second answer to a case with the first; `varies`: its images may differ within the limits."""
    from rayproof.reports.run.judge_task import compare_repeated

    return compare_repeated(case, first, again, varies=varies)


def ask_capabilities(subject: Subject, *, seconds: float) -> Capabilities | str:
    """Return the capabilities that a program declares, or a sentence about the error in its reply."""
    from rayproof.reports.subjects import program

    server = _server(subject)
    try:
        capabilities = program.ask_capabilities(subject, seconds=seconds, server=server)
        if server is not None:
            server.standing()  # its start is no part of the first case
    except ValueError as wrong:
        return str(wrong)
    return capabilities


@cache
def _reference(name: str) -> Reference:
    """Return this process's instance of a reference."""
    from rayproof.reference import REFERENCES

    return REFERENCES[name]()


_SERVERS: list["Server"] = []  # of this process: one at most


def _server(subject: Subject) -> "Server | None":
    """Return the server of a program that stays alive, started once in this process; None for other subjects."""
    from rayproof.reports.subjects.serving import Server

    if not subject.stays:
        return None
    if not _SERVERS:
        _SERVERS.append(Server(subject))
        atexit.register(_SERVERS[0].close)
    _SERVERS[0].subject = subject
    return _SERVERS[0]


def _render_program(scene: Scene, samples: int, subject: Subject, keep: Path | None) -> Render:
    from rayproof.reports.subjects.program import ask_program, notes_on

    able, server = subject.capabilities, _server(subject)
    # A run's environment names Python's own version, too.
    name = "function" if subject.transport == FUNCTION else subject.name
    answers = ask_program(subject, scene, samples=samples, keep=keep, server=server)
    return Render(
        answers=answers,
        versions={name: f"{able.title} ({able.precision}, written as float32)"},
        notes=(*notes_on(subject, scene), *(() if server is None else server.notes())),
        standing=None if server is None else server.standing(),
    )


def _as_subject(answers: Answers) -> Answers:
    """Return a reference's answers as a subject's answers."""
    return replace(answers, items=ITEMS_OF_OTHERS, independent=False, chained=False, cached=False, mishaps=())


def ask_reference(
    name: str, reference: Reference, scene: Scene, *, samples: int = 1, cached: bool = False, independent: bool
) -> Answers:
    """Return a reference's answers to a scene with all that it declares, or an error if it is not installed."""
    question, unsupported = _question(name, reference, scene, samples)
    missing = _ability(reference, "missing")
    if missing is not None and (why := missing()) is not None:
        about = {"name": name, "precision": reference.precision, "independent": independent}
        return Answers(**about, unsupported=unsupported, error=why)
    rendered = _rendered(question, cached=cached)
    return _witness(question, rendered, unsupported, independent=independent)


def cached_answers(name: str, reference: Reference, scene: Scene, *, samples: int, independent: bool) -> Answers | None:
    """Return the result of `ask_reference` if the cache has all of it, else None.

    Raises:
        DamagedEntryError: the cached entry differs from the written one.

    """
    question, unsupported = _question(name, reference, scene, samples)
    rendered = reference_cache.recalled(question) if question.stages else Rendered(answers={}, mean=None, cached=False)
    return None if rendered is None else _witness(question, rendered, unsupported, independent=independent)


def unable(reference: Reference, scene: Scene, stage: Stage) -> str | None:
    """Return the reason why a reference cannot answer a stage of a scene, or None."""
    if any(scene.camera.sample_offset) and not getattr(reference, "takes_sample_offset", False):
        return "Its rays pass through the pixels' centres."
    return reference.unsupported(scene, stage)


def _question(
    name: str, reference: Reference, scene: Scene, samples: int
) -> tuple[ReferenceQuestion, dict[Stage, str]]:
    """Return the request to a reference, and the reasons why it does not contain the other stages."""
    stages = stages_of(scene)
    unsupported = {stage: why for stage in stages if (why := unable(reference, scene, stage)) is not None}
    supported = tuple(stage for stage in stages if stage not in unsupported)
    question = ReferenceQuestion(name=name, reference=reference, scene=scene, stages=supported, samples=samples)
    return question, unsupported


def _witness(
    question: ReferenceQuestion, rendered: Rendered, unsupported: dict[Stage, str], *, independent: bool
) -> Answers:
    reference, scene, answers = question.reference, question.scene, rendered.answers
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
        mishaps=rendered.notes,
        mean=rendered.mean,
        cached=rendered.cached,
        settings=dict(settings(scene)) if settings is not None else {},
        resolutions={stage: value for stage, value in coarse.items() if value is not None},
        ray_epsilon=float(getattr(reference, "ray_epsilon", 0.0)),
        light_epsilon=float(getattr(reference, "light_epsilon", 0.0)),
        edge_epsilon=float(beyond(scene)) if (beyond := _ability(reference, "edge_epsilon")) is not None else 0.0,
        tie_epsilon=float(apart(scene)) if (apart := _ability(reference, "tie_epsilon")) is not None else 0.0,
    )


def _rendered(question: ReferenceQuestion, *, cached: bool) -> Rendered:
    """Return the reference's images, from the cache if `cached`."""

    def render() -> tuple[StageImages, np.ndarray | None]:
        reference, scene, stages = question.reference, question.scene, question.stages
        answers: StageImages = reference.render(scene, stages) if stages else {}
        mean = None
        if question.samples > 1 and Stage.RADIANCE in stages:
            mean = reference.render(scene, (Stage.RADIANCE,), samples=question.samples)[Stage.RADIANCE]
        return answers, mean

    if cached and question.stages:
        return reference_cache.cached(question, render)
    answers, mean = render()
    return Rendered(answers=answers, mean=mean, cached=False)


def _shadow_epsilon(reference: Reference, scene: Scene, answers: StageImages) -> float | np.ndarray:
    """Return the shadow epsilon [m] of a reference, one number or (height, width); 0 if it declares none."""
    if Stage.POSITION not in answers:
        return 0.0
    of_scene, of_answers = _ability(reference, "epsilon_in"), _ability(reference, "epsilon_at")
    if of_scene is not None:
        return of_scene(scene, answers)
    return of_answers(answers) if of_answers is not None else 0.0


def _ability(reference: Reference, name: str) -> Any:
    """Return an optional method of a reference (reference/__init__.py lists them), or None."""
    return getattr(reference, name, None)
