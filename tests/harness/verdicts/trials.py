"""One random scene in a worker: the renderer under test is judged, then who is tried beside it, then a liar.

Planted faults of the tracer and the C++ example are tried, so that there is something to accuse.
"""

import shutil
import subprocess
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NotRequired, TypedDict

from rayproof import ROOT
from rayproof.cases.case import Case
from rayproof.cases.random_scenes import numbers, random_case
from rayproof.cases.random_scenes.draft import Draws
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.verdict import Judged, of_what_is_supported
from rayproof.reports.processes.worker import serve
from rayproof.reports.run.tracer_task import trace
from rayproof.reports.run.worker_tasks import render_reference, render_subject
from rayproof.reports.run.workers import ask
from rayproof.reports.subjects import PROGRAM, THE_TRACER, Subject
from rayproof.reports.subjects.choosing import chosen
from rayproof.tracer.kernel.compiler import choose_packaged_llvm
from tests.harness.audit.liar import lie
from tests.harness.audit.orders import LiarOrder
from tests.harness.audit.planted import PlantedFault, tracer_faults
from tests.harness.verdicts.certify import CertifiedRecord, certify

KIND = "verdicts"
FAULT_EACH, PROGRAM_EACH = 10, 5  # scenes; the liar comes with the fault
SOURCE = ROOT / "examples" / "renderers" / "lecture.cpp"
BUILDING = 300.0  # s that a compiler may take
RENDERING, MEMORY = 120.0, 2**33  # s and bytes that a program may take for a scene


@dataclass(frozen=True, kw_only=True)
class Trial:
    """Another renderer that is judged on a scene: a planted fault, or another program."""

    name: str  # the candidate's: a configuration of the tracer, or the program's
    subject: Subject = THE_TRACER


@dataclass(frozen=True, kw_only=True)
class SceneOrder:
    """Judge one random scene, and certify the verdicts."""

    seed: int
    number: int
    subject: Subject
    configurations: tuple[str, ...]  # of the tracer, where it is the subject
    panel: tuple[str, ...]  # references
    trials: tuple[Trial, ...]
    lying: bool  # a liar is let loose on it, too


class SceneRecord(TypedDict):
    """What became of a scene."""

    case: str
    subject: str
    certified: NotRequired[list[CertifiedRecord]]  # of the subject, then of each trial
    lie: NotRequired[dict[str, Any] | None]  # a LiarReport
    error: NotRequired[str]  # why there is nothing else
    stopped: NotRequired[bool]  # by a time limit


@lru_cache(maxsize=1)
def _faults() -> tuple[PlantedFault, ...]:
    """Return the tracer's planted faults, without those that are right on every valid scene."""
    return tuple(fault for fault in tracer_faults() if fault.equivalent is None)


def fault_for(case: Case) -> PlantedFault | None:
    """Return the planted fault that is tried on a random scene: each tenth scene has one that concerns its items."""
    seed, number = numbers(case.name)
    if not is_tenth(number):
        return None
    concerning = [fault for fault in _faults() if set(fault.covers) & set(case.covers)]
    return Draws(seed, number).choice(concerning) if concerning else None


def is_tenth(number: int) -> bool:
    """Say whether a fault is tried on a scene of this number, and a liar is let loose."""
    return number % FAULT_EACH == FAULT_EACH - 1


def trials(case: Case, program: Subject | None) -> tuple[Trial, ...]:
    """Return who is tried on a random scene."""
    tried: list[Trial] = []
    fault = fault_for(case)
    if fault is not None and fault.configuration is not None:
        tried.append(Trial(name=fault.configuration))
    if program is not None and numbers(case.name)[1] % PROGRAM_EACH == 0:
        tried.append(Trial(name=PROGRAM, subject=program))
    return tuple(tried)


def example(folder: Path) -> Subject | str:
    """Return the shipped C++ example, built into `folder`, or why there is none."""
    compiler = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        return "there is no C++ compiler, so that the C++ example is not judged"
    program = folder / "lecture"
    command = [compiler, "-O2", "-std=c++17", "-o", str(program), str(SOURCE)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        subprocess.run(command, check=True, capture_output=True, timeout=BUILDING)
    except (OSError, subprocess.SubprocessError) as error:
        return f"the C++ example cannot be built, and is not judged: {error}"
    return subject_named(f"{PROGRAM}:{program.absolute()} {{scene}} {{output}}")


def subject_named(text: str) -> Subject:
    """Return the subject that is named so; raise ValueError, LookupError or OSError as `chosen` does."""
    return chosen(text, seconds=RENDERING, memory=MEMORY, ask=ask)


def serve_scenes(kind: str, connection: Any) -> None:
    """Judge scenes until the other end closes."""
    choose_packaged_llvm()
    serve(kind, connection, handlers=lambda _: judge_scene)


def answers_of(case: Case, subject: Subject, configurations: Iterable[str]) -> tuple[list[Answers], dict[str, str]]:
    """Return what a subject answers, the tracer by each configuration, and the versions of what computed it."""
    if subject.is_tracer:
        renders = [trace(case.scene, name) for name in configurations]
    else:
        renders = [render_subject(case.scene, 1, subject)]
    versions = {name: version for render in renders for name, version in render.versions.items()}
    return [render.answers for render in renders], versions


def judge_scene(order: SceneOrder) -> SceneRecord:
    """Return what certified arithmetic says of the verdicts on a scene, and what a liar can hide there."""
    case, oracle = random_case(order.seed, order.number), Analytic()
    candidates, versions = answers_of(case, order.subject, order.configurations)
    witnesses = []
    for name in order.panel:
        render = render_reference(name, case.scene)
        witnesses.append(render.answers)
        versions |= render.versions

    def judged(some: list[Answers]) -> Judged:
        verdict = judge_case(case, some, witnesses, oracle, versions, panel=order.panel)
        return of_what_is_supported(verdict, some)

    certified = [certify(judged(candidates), candidates, witnesses, oracle).as_json()]
    for trial in order.trials:
        some, _ = answers_of(case, trial.subject, (trial.name,))
        verdict = judged(some)
        certified.append(
            {
                **certify(verdict, some, witnesses, oracle, planted=trial.subject.is_tracer).as_json(),
                "tried": trial.name,
                "verdict": verdict.outcome.value,
                "stage": verdict.stage.value if verdict.stage else None,
                "reason": verdict.reason,
            }
        )
    told = asdict(lie(LiarOrder(case=case, epsilon=0.0))) if order.lying else None
    return {"case": case.name, "subject": order.subject.title, "certified": certified, "lie": told}
