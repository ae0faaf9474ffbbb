"""The record of a case that nobody judged, because its judge died or raised: every planned check is an error."""

from collections.abc import Sequence
from pathlib import Path

from rayproof.cases.case import Case
from rayproof.reports.judge.answers import Candidate, Witness
from rayproof.reports.judge.measurement import unexamined
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.processes.worker import Reply
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CaseRecord, CheckRecord
from rayproof.reports.run.record.common_factors import camera_and_lights
from rayproof.reports.run.record.reproducing import write_scene
from rayproof.reports.subjects import Subject


def unjudged(
    case: Case,
    candidates: Sequence[Candidate],
    witnesses: Sequence[Witness],
    reply: Reply,
    *,
    folder: Path,
    subject: Subject,
) -> CaseRecord:
    """Return the record, as docs/results.md describes it; `reply` is what came of judging."""
    why = f"judging failed: {reply.error}"
    checks: list[CheckRecord] = [
        {
            "configuration": candidate.name,
            "reference": witness.name,
            "stage": stage.value,
            "verdict": Outcome.ERROR.value,
            "reason": why,
            "ratio": 0.0,
            "end_to_end": None,
            "continued": None,
            "examined": unexamined(stage, case.scene.camera).as_json(),
            "because": "",
        }
        for candidate in candidates
        for witness in witnesses
        for stage in stages_of(case.scene)
        if witness.answers_at(stage)
    ]
    renders = [(subject.renderer(one.name), one.name, one.error, False) for one in candidates]
    renders += [(one.name, None, one.error, one.cached) for one in witnesses]
    return {
        "name": case.name,
        "family": case.family,
        "verdict": Outcome.ERROR.value,
        "stage": None,
        "item": None,
        "reason": why,
        "trace": reply.trace,
        "stresses": case.stresses,
        "covers": list(case.covers),
        "planned": len(checks),
        "scene": write_scene(folder, case),
        "picture": None,
        "width": case.scene.camera.width,
        "height": case.scene.camera.height,
        "lights": len(case.scene.lights),
        "camera_and_lights": camera_and_lights(case.scene),
        "shapes": [type(shape).__name__ for shape in case.scene.shapes],
        "settings": {},
        "renders": [
            {"renderer": name, "configuration": configuration, "image": None, "error": error, "cached": cached}
            for name, configuration, error, cached in renders
        ],
        "ran": {},
        "unsupported": [],
        "abstained": {one.name: one.error for one in witnesses if one.error is not None},
        "stopped": [one.name for one in (*candidates, *witnesses) if one.stopped] + ["the judge"] * reply.stopped,
        "notes": [],
        "checks": checks,
        "expectations": [],
        "adjudication": {},
        "pixels": None,
        "masks": None,
    }
