"""What workers do: render with the tracer, a reference or a stranger's program; judge a case."""

from collections.abc import Callable
from typing import Any

from rayproof.reports.judge.answers import Candidate, Witness
from rayproof.reports.run.cache_store import DamagedEntryError
from rayproof.tracer.kernel.compiler import choose_packaged_llvm
from rayproof.reports.run.messages import QuestionTask, RecallTask, ReferenceTask, SubjectTask
from rayproof.reports.run.reference_cache import damage
from rayproof.reports.run.tasks.kinds import JUDGE, RECALLING, TRACING, UNDER_TEST
from rayproof.reports.run.tasks.reference_task import heard, put_to_test, recalled
from rayproof.reports.subjects import PROGRAM


def handler(kind: str) -> Callable[[Any], Any]:
    """Return the function that does a worker's tasks; its imports are made here, once, in the worker."""
    choose_packaged_llvm()
    if kind == TRACING:
        from rayproof.reports.run.tasks.trace_task import prepare, trace

        prepare()
        return trace
    if kind == JUDGE:
        from rayproof.reports.run.tasks.judge_task import judge

        return judge
    if kind == RECALLING:
        return _recall
    if kind == PROGRAM:
        return _run_program
    if kind.startswith(UNDER_TEST):
        return _tested(kind.removeprefix(UNDER_TEST))
    return _refer(kind.removeprefix("reference:"))


def _refer(name: str) -> Callable[[ReferenceTask], tuple[Witness, dict[str, str]]]:
    """Return the task of one reference."""
    from rayproof.reference import REFERENCES

    reference = REFERENCES[name]()
    independent = bool(REFERENCES.about(name).get("independent", False))

    def refer(task: ReferenceTask) -> tuple[Witness, dict[str, str]]:
        witness = heard(name, reference, task, independent=independent)
        return witness, {name: reference.version()}

    return refer


def _recall(task: RecallTask) -> tuple[dict[str, tuple[Witness, str]], dict[str, str]]:
    """Return what the cache knows, and what is to be told of entries that were damaged.

    One worker asks it for all references, none of which need start for it.
    """
    from rayproof.reference import REFERENCES

    found, damaged = {}, {}
    for name in task.names:
        reference = REFERENCES[name]()
        independent = bool(REFERENCES.about(name).get("independent", False))
        try:
            witness = recalled(name, reference, task.task, independent=independent)
        except DamagedEntryError as wrong:
            damaged[name] = damage(wrong)
            continue
        if witness is not None:
            found[name] = (witness, reference.version())
    return found, damaged


def _tested(name: str) -> Callable[[SubjectTask], tuple[Candidate, dict[str, str], tuple[str, ...]]]:
    """Return the task of a reference under test; nothing of it is taken from a cache."""
    from rayproof.reference import REFERENCES

    reference = REFERENCES[name]()

    def test(task: SubjectTask) -> tuple[Candidate, dict[str, str], tuple[str, ...]]:
        asked = ReferenceTask(scene=task.scene, samples=task.samples)
        witness = heard(name, reference, asked, independent=False)
        return put_to_test(witness), {name: reference.version()}, witness.notes

    return test


def _run_program(task: SubjectTask | QuestionTask) -> Any:
    """Have a stranger's program render, or say what it can."""
    from rayproof.reports.subjects.program import ask_capabilities, candidate

    if isinstance(task, QuestionTask):
        try:
            return ask_capabilities(task.subject, seconds=task.seconds)
        except ValueError as wrong:
            return str(wrong)
    able = task.subject.capabilities
    versions = {task.subject.name: f"{able.title} ({able.precision}, written as float32)"}
    answered = candidate(task.subject, task.scene, case=task.case, samples=task.samples, keep=task.keep)
    return answered, versions, able.told(task.scene)
