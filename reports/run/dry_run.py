"""`rayproof run --dry-run`: the plan of a run, with estimates of its time and memory."""

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
PROCESS = 0.15e9  # bytes of a process of the panel before it renders


def plan_in_words(request: RunOptions, pool: Pool | None = None) -> list[str]:
    """Return the lines that `--dry-run` prints; `pool` contains a program that stays alive, if it was started.

    Raises:
        LookupError, ValueError, OSError: the request itself is wrong.

    """
    subject = request.subject
    planned = planned_cases(request)
    chosen_panel = panel(request.require, subject)
    estimates = [
        estimate(planned_case.case, configurations=len(planned_case.configurations), references=len(chosen_panel.names))
        for planned_case in planned
    ]
    renders = sum(
        (1 + planned_case.twice) * len(planned_case.configurations) + len(chosen_panel.names)
        for planned_case in planned
    )
    checks, images = (
        sum(_checks(planned_case, chosen_panel.names, but=but) for planned_case in planned)
        for but in ((), (Stage.CAMERA,))
    )
    largest = max(zip(planned, estimates, strict=True), key=lambda pair: pair[1].seconds)
    things = {"case": planned, "configuration": configurations_of(planned), "reference": chosen_panel.names}
    counts = ", ".join(several(len(entries), noun) for noun, entries in things.items())
    return [
        f"plan: {counts} ({', '.join(chosen_panel.names)}); {several(renders, 'render')}, {several(checks, 'check')}"
        + f", {images} of them of images" * subject.is_program,
        *(f"not asked: {name}: {why}" for name, why in chosen_panel.absent.items()),
        f"largest case: {_about(largest[0])}",
        *_estimated(request, planned, estimates, pool, references=len(chosen_panel.names)),
    ]


def _about(planned: PlannedCase) -> str:
    scene, samples = planned.case.scene, planned.case.samples
    finer = f", {samples} x {samples} samples" if samples > 1 else ""
    counts = {"shape": len(scene.shapes), "triangle": triangles_of(scene), "light": len(scene.lights)}
    contents = ", ".join(several(count, noun) for noun, count in counts.items() if count)
    return f"{planned.case.name}, {scene.camera.width} x {scene.camera.height} px{finer}, {contents}"


def _checks(planned: PlannedCase, references: tuple[str, ...], *, but: tuple[Stage, ...]) -> int:
    """Return the number of a case's checks at the stages that each reference supports, without the stages `but`."""
    from rayproof.reference import REFERENCES

    scene, instances = planned.case.scene, [REFERENCES[name]() for name in references]
    stages = [stage for stage in stages_of(scene) if stage not in but]
    answered = sum(unable(reference, scene, stage) is None for reference in instances for stage in stages)
    means = sum(reference.unsupported(scene, Stage.RADIANCE) is None for reference in instances)
    finer = means if planned.case.samples > 1 and scene.lights else 0
    return len(planned.configurations) * (answered + finer)


def _estimated(
    request: RunOptions,
    planned: Sequence[PlannedCase],
    estimates: list[Estimate],
    pool: Pool | None,
    *,
    references: int,
) -> Iterator[str]:
    """Yield time, memory, disk and deadlines."""
    start, call, case = _called(request, planned, pool)
    calls = sum(1 + planned_case.twice for planned_case in planned)
    seconds = start + (sum(cost.seconds for cost in estimates) + calls * call) / request.jobs
    if case is not None:
        alive = f"{start:.2g} s to start once for each worker, and " if request.subject.stays else ""
        yield f"the program takes {alive}{call:.2g} s for {case}; it answers {calls} times"
    worst = max(cost.memory for cost in estimates)
    at_once = 1 if max(cost.memory for cost in estimates) > LARGE else request.jobs
    together = at_once * worst + (worst - BEGINNING) + (references + 3) * PROCESS
    disk = sum(cost.disk for cost in estimates)
    machine_memory, free_disk = psutil.virtual_memory().total, shutil.disk_usage(_existing(request.out)).free
    yield f"estimated time: {in_words(seconds)} on {request.jobs} processors, with nothing taken from the cache"
    memory = f"{worst / GB:.1f} GB in the largest process, {together / GB:.1f} GB in all"
    lacking = NOT_ENOUGH if together > machine_memory else ""
    yield f"estimated memory: {memory}; this machine has {machine_memory / GB:.1f} GB{lacking}"
    lacking = NOT_ENOUGH if disk > free_disk else ""
    yield f"estimated disk: at most {disk / GB:.2g} GB in {request.out}; {free_disk / GB:.1f} GB are free{lacking}"
    limit = request.timeout
    if request.patient:
        limit = max(
            deadline(planned_case.case, configurations=len(planned_case.configurations), references=references)
            for planned_case in planned
        )
    yield f"deadline: {limit:.0f} s for one render or one judgement" + (
        " of the largest case" * (limit > request.timeout)
    )


def _called(request: RunOptions, planned: Sequence[PlannedCase], pool: Pool | None) -> tuple[float, float, str | None]:
    """Return a program's start time [s], its time [s] for a case of median size, and the name of that case.

    They are 0, 0 and None if the subject is no program or draws no case. The start of a program that is called for each
    image is part of the call.
    """
    if not request.subject.is_program:
        return 0.0, 0.0, None
    able = request.subject.capabilities
    cases = [planned_case.case for planned_case in planned if able.refusal(planned_case.case.scene) is None]
    if not cases:
        return 0.0, 0.0, None
    case = sorted(cases, key=lambda case: case.scene.camera.width * case.scene.camera.height)[len(cases) // 2]
    took: list[tuple[float, float]] = []
    answered(request.subject, case.scene, told=lambda start, call: took.append((start, call)), pool=pool)
    return *took[0], case.name


def in_words(seconds: float) -> str:
    """Return a rounded duration in a fitting unit."""
    for unit, size in (("days", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 2 * size:
            return f"about {seconds / size:.0f} {unit}"
    return f"about {max(1, round(seconds))} s"


def _existing(folder: Path) -> Path:
    """Return the folder, or its nearest parent that exists."""
    folder = folder.absolute()
    return next(path for path in (folder, *folder.parents) if path.exists())
