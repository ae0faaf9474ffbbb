"""The judge's task: judge a case, write its images and its scene, return its record for results.json."""

from functools import cache
from pathlib import Path
from typing import Any

from cases.stages import IMAGE_STAGES
from reference.analytic import Analytic
from reports.judge.judging import judge_case
from reports.judge.outcomes import Outcome, worst
from reports.judge.remembering import Remembering
from reports.judge.sentinels import stand_guard
from reports.judge.summing_up import Judged
from reports.publish.exr import write_answers
from reports.run.orders import JudgeTask
from reports.run.reproducing import reproduce, write_scene
from tracer.configuration import Configuration

_ORACLE = Analytic()


@cache
def _guarded() -> int:
    """Judge the sentinels before the first case; raise BrokenJudgeError if the judge gets one wrong."""
    return stand_guard(_ORACLE)


def judge(task: JudgeTask) -> dict[str, Any]:
    """Judge one case and return its record."""
    _guarded()
    judged = judge_case(task.case, task.candidates, task.witnesses, Remembering(_ORACLE), task.versions)
    for witness in task.witnesses:
        if witness.name in task.require and not witness.answers:
            why = witness.error or next(iter(witness.unsupported.values()), "it answered nothing")
            judged.outcome = worst([judged.outcome, Outcome.FAIL])
            judged.reason = judged.reason or f"{witness.name} is required and could not answer: {why}"
    scene = write_scene(task.folder, task.case)
    images = _write_images(task, everyone=judged.outcome is not Outcome.PASS)
    return _record(task, judged, scene, images)


def _write_images(task: JudgeTask, *, everyone: bool) -> dict[str, str]:
    """Write renderers' stages as one EXR each; return renderer -> relative path.

    Of a case that passed the first configuration and the independent witnesses are enough to look at; of any other
    every renderer may be the one to look at.
    """
    written: dict[str, str] = {}
    lights = len(task.case.scene.lights)
    candidates = task.candidates if everyone else task.candidates[:1]
    witnesses = [witness for witness in task.witnesses if everyone or witness.independent]
    parties = [(f"tracer-{c.name}", c.answers) for c in candidates] + [(w.name, w.answers) for w in witnesses]
    for name, answers in parties:
        images = {stage: image for stage, image in (answers or {}).items() if stage in IMAGE_STAGES}
        if images:
            path = Path("images", task.case.name, f"{name.replace('/', '+')}.exr")
            (task.folder / path).parent.mkdir(parents=True, exist_ok=True)
            write_answers(task.folder / path, images, lights=lights, comments=_comments(name))
            written[name] = path.as_posix()
    return written


def _comments(renderer: str) -> str:
    """Return what an image's header must say of who made it: a wrong formula shouts here too."""
    if not renderer.startswith("tracer-"):
        return renderer
    configuration = Configuration.parse(renderer.removeprefix("tracer-"))
    wrong = (*configuration.faults, *configuration.controls)
    return f"PLANTED FAULT: {', '.join(wrong)}; {renderer}" if wrong else renderer


def _record(task: JudgeTask, judged: Judged, scene: str, images: dict[str, str]) -> dict[str, Any]:
    """Return the case's record, as docs/results.md describes it."""
    case = task.case
    errors = {f"tracer-{c.name}": c.error for c in task.candidates} | {w.name: w.error for w in task.witnesses}
    return {
        "name": case.name,
        "family": case.family,
        "verdict": judged.outcome.value,
        "stage": judged.stage.value if judged.stage else None,
        "item": judged.item,
        "reason": judged.reason,
        "stresses": case.stresses,
        "covers": list(case.covers),
        "planned": judged.planned,
        "reproduce": reproduce(task.folder, case, tuple(candidate.name for candidate in task.candidates)),
        "scene": scene,
        "picture": None,
        "width": case.scene.camera.width,
        "height": case.scene.camera.height,
        "lights": len(case.scene.lights),
        "shapes": [type(shape).__name__ for shape in case.scene.shapes],
        "renders": [{"renderer": name, "image": images.get(name), "error": error} for name, error in errors.items()],
        "ran": {candidate.name: sorted(candidate.items) for candidate in task.candidates if candidate.answers},
        "unsupported": [
            {"reference": witness.name, "stage": stage.value, "why": why}
            for witness in task.witnesses
            for stage, why in witness.unsupported.items()
        ],
        "notes": [{"reference": witness.name, "note": note} for witness in task.witnesses for note in witness.notes],
        "checks": [check.as_json() for check in judged.checks],
        "expectations": judged.expectations,
    }
