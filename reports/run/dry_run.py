"""`rayproof run --dry-run`: what a run would do, its time and memory."""

import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import psutil

from rayproof.cases.stages import Stage
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.processes.pool import Pool
from rayproof.reports.results.files import several
from rayproof.reports.run.options import RunOptions
from rayproof.reports.run.plan import PlannedCase, configurations_of, panel
from rayproof.reports.run.scenes import BEGINNING, LARGE, Estimate, deadline, estimate, triangles_of
from rayproof.reports.run.suite import planned_cases
from rayproof.reports.run.worker_tasks import unable
from rayproof.reports.run.workers import answered

GB = 1e9
NOT_ENOUGH = ", which is not enough"
PROCESS = 0.15e9  # bytes that a process of the panel takes to begin with


def plan_in_words(request: RunOptions, pool: Pool | None = None) -> list[str]:
    """Return the lines that `--dry-run` prints; a program that stays alive was started in a `pool`.

    Raises:
        LookupError, ValueError, OSError: the request itself is wrong.

    """
    subject = request.subject
    planned = planned_cases(request)
    heard = panel(request.require, subject)
    each = [estimate(one.case, configurations=len(one.configurations), references=len(heard.names)) for one in planned]
    renders = sum((1 + one.twice) * len(one.configurations) + len(heard.names) for one in planned)
    checks, images = (sum(_checks(one, heard.names, but=but) for one in planned) for but in ((), (Stage.CAMERA,)))
    largest = max(zip(planned, each, strict=True), key=lambda both: both[1].seconds)
    things = {"case": planned, "configuration": configurations_of(planned), "reference": heard.names}
    counts = ", ".join(several(len(there), noun) for noun, there in things.items())
    return [
        f"plan: {counts} ({', '.join(heard.names)}); {several(renders, 'render')}, {several(checks, 'check')}"
        + f", {images} of them of images" * subject.is_program,
        *(f"not asked: {name}: {why}" for name, why in heard.absent.items()),
        f"largest case: {_about(largest[0])}",
        *_estimated(request, planned, each, pool, references=len(heard.names)),
    ]


def _about(planned: PlannedCase) -> str:
    scene, samples = planned.case.scene, planned.case.samples
    finer = f", {samples} x {samples} samples" if samples > 1 else ""
    counts = {"shape": len(scene.shapes), "triangle": triangles_of(scene), "light": len(scene.lights)}
    there = ", ".join(several(count, noun) for noun, count in counts.items() if count)
    return f"{planned.case.name}, {scene.camera.width} x {scene.camera.height} px{finer}, {there}"


def _checks(planned: PlannedCase, references: tuple[str, ...], *, but: tuple[Stage, ...]) -> int:
    """Return how many checks a case has: of every stage, `but` some, that a reference does not say it cannot."""
    from rayproof.reference import REFERENCES

    scene, asked = planned.case.scene, [REFERENCES[name]() for name in references]
    stages = [stage for stage in stages_of(scene) if stage not in but]
    answered = sum(unable(reference, scene, stage) is None for reference in asked for stage in stages)
    means = sum(reference.unsupported(scene, Stage.RADIANCE) is None for reference in asked)
    finer = means if planned.case.samples > 1 and scene.lights else 0
    return len(planned.configurations) * (answered + finer)


def _estimated(
    request: RunOptions, planned: Sequence[PlannedCase], each: list[Estimate], pool: Pool | None, *, references: int
) -> Iterator[str]:
    """Yield time, memory, disk and deadlines."""
    start, call, case = _called(request, planned, pool)
    calls = sum(1 + one.twice for one in planned)
    seconds = start + (sum(one.seconds for one in each) + calls * call) / request.jobs
    if case is not None:
        alive = f"{start:.2g} s to start once for each worker, and " if request.subject.stays else ""
        yield f"the program takes {alive}{call:.2g} s for {case}; it answers {calls} times"
    worst = max(one.memory for one in each)
    at_once = 1 if max(one.memory for one in each) > LARGE else request.jobs
    together = at_once * worst + (worst - BEGINNING) + (references + 3) * PROCESS
    disk = sum(one.disk for one in each)
    memory_there, disk_there = psutil.virtual_memory().total, shutil.disk_usage(_existing(request.out)).free
    yield f"estimated time: {in_words(seconds)} on {request.jobs} processors, with nothing taken from the cache"
    memory = f"{worst / GB:.1f} GB in the largest process, {together / GB:.1f} GB in all"
    lacking = NOT_ENOUGH if together > memory_there else ""
    yield f"estimated memory: {memory}; this machine has {memory_there / GB:.1f} GB{lacking}"
    lacking = NOT_ENOUGH if disk > disk_there else ""
    yield f"estimated disk: at most {disk / GB:.2g} GB in {request.out}; {disk_there / GB:.1f} GB are free{lacking}"
    limit = request.timeout
    if request.patient:
        limit = max(
            deadline(one.case, configurations=len(one.configurations), references=references) for one in planned
        )
    yield f"deadline: {limit:.0f} s for one render or one judgement" + (
        " of the largest case" * (limit > request.timeout)
    )


def _called(request: RunOptions, planned: Sequence[PlannedCase], pool: Pool | None) -> tuple[float, float, str | None]:
    """Return how long a program takes to start and to answer a case of middling size [s], and which; or nothing.

    A program that is called for each image starts within the call.
    """
    if not request.subject.is_program:
        return 0.0, 0.0, None
    able = request.subject.capabilities
    cases = [one.case for one in planned if able.refusal(one.case.scene) is None]
    if not cases:
        return 0.0, 0.0, None
    case = sorted(cases, key=lambda case: case.scene.camera.width * case.scene.camera.height)[len(cases) // 2]
    took: list[tuple[float, float]] = []
    answered(request.subject, case.scene, told=lambda start, call: took.append((start, call)), pool=pool)
    return *took[0], case.name


def in_words(seconds: float) -> str:
    """Return a duration as one reads it."""
    for unit, size in (("days", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 2 * size:
            return f"about {seconds / size:.0f} {unit}"
    return f"about {max(1, round(seconds))} s"


def _existing(folder: Path) -> Path:
    """Return the folder, or the nearest one above it that is there."""
    folder = folder.absolute()
    return next(path for path in (folder, *folder.parents) if path.exists())
