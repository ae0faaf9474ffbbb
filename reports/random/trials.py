"""Who is judged on random scenes beside the one under test: planted faults of the tracer, and the C++ example."""

import shutil
import subprocess
from functools import lru_cache
from pathlib import Path

from cases.case import Case
from cases.random import numbers
from cases.random.draws import Draws
from reports.audit.planted import PlantedFault, tracer_faults
from reports.run.asked import ask
from reports.run.request import Trial
from reports.subjects import PROGRAM, Subject
from reports.subjects.choosing import chosen

FAULT_EACH, PROGRAM_EACH = 10, 5  # scenes
SOURCE = Path(__file__).parents[2] / "examples" / "renderers" / "lecture.cpp"
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
