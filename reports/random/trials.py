"""Who is judged on random scenes beside the one under test: planted faults of the tracer, and the C++ example."""

import shutil
import subprocess
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from rayproof import ROOT
from rayproof.cases.case import Case
from rayproof.cases.random_scenes import numbers
from rayproof.cases.random_scenes.draft import Draws
from rayproof.reports.audit.orders import LiarOrder, LiarReport
from rayproof.reports.audit.planted import PlantedFault, tracer_faults
from rayproof.reports.audit.worker import serve_audit
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Reply
from rayproof.reports.run.asking_subject import ask
from rayproof.reports.run.request import RunRequest, Trial
from rayproof.reports.subjects import PROGRAM, Subject
from rayproof.reports.subjects.choosing import chosen

FAULT_EACH, PROGRAM_EACH = 10, 5  # scenes; the liar comes with the fault
LIAR = "liar"
SOURCE = ROOT / "examples" / "renderers" / "lecture.cpp"
BUILDING = 300.0  # s that a compiler may take
RENDERING, MEMORY = 120.0, 2**33  # s and bytes that the example may take for a scene


@lru_cache(maxsize=1)
def _faults() -> tuple[PlantedFault, ...]:
    """Return the tracer's planted faults, without those that are right on every valid scene."""
    return tuple(fault for fault in tracer_faults() if fault.equivalent is None)


def fault_for(case: Case) -> PlantedFault | None:
    """Return the planted fault that is tried on a random scene: each tenth scene has one that concerns its items."""
    seed, number = numbers(case.name)
    if number % FAULT_EACH != FAULT_EACH - 1:
        return None
    concerning = [fault for fault in _faults() if set(fault.covers) & set(case.covers)]
    return Draws(seed, number).choice(concerning) if concerning else None


def trials(case: Case, program: Subject | None) -> tuple[Trial, ...]:
    """Return who is tried on a random scene."""
    found: list[Trial] = []
    fault = fault_for(case)
    if fault is not None and fault.configuration is not None:
        found.append(Trial(name=fault.configuration))
    if program is not None and numbers(case.name)[1] % PROGRAM_EACH == 0:
        found.append(Trial(name=PROGRAM, subject=program))
    return tuple(found)


def lies(cases: Sequence[Case], request: RunRequest) -> tuple[list[LiarReport], list[str]]:
    """Let a liar loose on each tenth scene; return what it could spoil unseen, and why it could not be asked.

    A liar is no renderer: it asks the judge itself, again and again, which is why its verdict is not the run's.
    """
    chosen = [case for case in cases if numbers(case.name)[1] % FAULT_EACH == FAULT_EACH - 1]
    reports: list[LiarReport] = []
    errors: list[str] = []

    def done(reply: Reply, name: str) -> None:
        if reply.error is None:
            reports.append(reply.value)
        else:
            errors.append(f"{LIAR}, {name}: {reply.error}")

    pool = Pool(jobs=request.jobs, timeout=request.timeout, copies={"audit": request.jobs}, target=serve_audit)
    try:
        for case in chosen:
            order = LiarOrder(case=case, epsilon=0.0)
            pool.submit("audit", order, lambda reply, name=case.name: done(reply, name))
        while not pool.idle:
            pool.step()
    finally:
        pool.close()
    return sorted(reports, key=lambda report: numbers(report.case)), errors


def example(folder: Path) -> Subject | str:
    """Return the shipped C++ example, built into `folder`, or why there is none."""
    compiler = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        return "there is no C++ compiler, so that the C++ example is not judged"
    if not SOURCE.is_file():
        return f"{SOURCE.name} is not there, so that the C++ example is not judged"
    program = folder / "lecture"
    command = [compiler, "-O2", "-std=c++17", "-o", str(program), str(SOURCE)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        subprocess.run(command, check=True, capture_output=True, timeout=BUILDING)
    except (OSError, subprocess.SubprocessError) as error:
        return f"the C++ example cannot be built, and is not judged: {error}"
    return chosen(f"{PROGRAM}:{program.absolute()} {{scene}} {{output}}", seconds=RENDERING, memory=MEMORY, ask=ask)
