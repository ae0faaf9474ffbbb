"""What laws found as a results folder: each law on each case is a case of its own, so that all publishers know it.

The law is the reference, and what it says of the changed scene is its image; the scene file is the changed scene.
"""

import platform
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from rayproof.cases.case import Case
from rayproof.cases.laws import LAWS
from rayproof.cases.stages import Stage
from rayproof.reports.laws.judging import Judged
from rayproof.reports.laws.limits import K
from rayproof.reports.laws.orders import LawReport
from rayproof.reports.laws.suite import LawsRecord, LawsRequest, Pair, verdict
from rayproof.reports.publish import publish_all
from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.document import save_results
from rayproof.reports.results.exr import write_answers
from rayproof.reports.results.json_numbers import as_json
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CaseRecord, CheckRecord, MeasurementRecord, RenderRecord
from rayproof.reports.run.record import totals
from rayproof.reports.run.record.reproducing import write_scene

NAME = "laws.json"
REFERENCE = "law"
BECAUSE = f"{K} u times the scene's condition times (the value's size + pixels per radian x the neighbours' range)"
OUTCOMES = {"pass": Outcome.PASS, "fail": Outcome.FAIL, "error": Outcome.ERROR}


def publish(folder: Path, content: LawsRecord, reports: Sequence[LawReport], request: LawsRequest) -> None:
    """Write laws.json, results.json with images and scenes, and every publication of them."""
    write_text(folder / NAME, as_json(content, indent=1) + "\n")
    by_pair: dict[tuple[str, str], list[LawReport]] = {}
    for report in reports:
        by_pair.setdefault((report.law, report.case), []).append(report)
    done = [pair for pair in request.pairs if (pair.law, pair.case.name) in by_pair]
    records = [_record(folder, pair, by_pair[pair.law, pair.case.name], request) for pair in done]
    found = totals.of(records)
    detail = found.coverage
    faults = sorted({fault for name in content["configurations"] for fault in _faults(name, request)})
    save_results(
        folder,
        {
            "schema": 1,
            "rayproof": version("rayproof"),
            "command": " ".join(["rayproof", *sys.argv[1:]]),
            "started": datetime.now(UTC).isoformat(timespec="seconds"),
            "seconds": content["seconds"],
            "finished": content["finished"],
            "verdict": found.verdict(planned=len(request.pairs), tracer=False).value,
            "subject": request.subject.title,
            "faults": faults,
            "environment": {"python": sys.version.split()[0], "system": platform.platform(), "kind": "laws"},
            "configurations": content["configurations"],
            "references": {REFERENCE: {"version": version("rayproof"), "precision": "float64", "independent": False}},
            "absent": {},
            "summary": found.case_ledger(planned=len(request.pairs)),
            "checks": found.check_ledger(),
            "coverage": {item: entry["cases"] for item, entry in detail.items()},
            "coverage_detail": detail,
            "review": [],
            "findings": [],
            "cases": records,
        },
    )
    publish_all(folder)


def _faults(configuration: str, request: LawsRequest) -> tuple[str, ...]:
    if not request.subject.is_tracer:
        return ()
    from rayproof.tracer.configuration import Configuration

    return Configuration.parse(configuration).faults


def _record(folder: Path, pair: Pair, reports: Sequence[LawReport], request: LawsRequest) -> CaseRecord:
    """Return the record of one law on one case, as docs/results.md describes a case's."""
    about = LAWS.about(pair.law)
    name = f"{pair.law}/{pair.case.name.replace('/', '.')}"
    exhibit = next((one.exhibit for one in reports if one.alarms and one.exhibit), None)
    exhibit = exhibit or next((one.exhibit for one in reports if one.exhibit), None)
    words = (LAWS[pair.law].__doc__ or "").strip().split("\n")[0]
    case = Case(
        name=name,
        scene=exhibit.changed if exhibit else pair.case.scene,
        stresses=words,
        covers=about["implicates"],
        least_interior=0,
        most_edge=0.0,
    )
    checks = [check for report in reports for check in _checks(report)]
    worst = max((OUTCOMES.get(verdict(one), Outcome.UNSUPPORTED) for one in reports), key=list(Outcome).index)
    broken = next((check for check in checks if check["verdict"] == Outcome.FAIL), None)
    camera = case.scene.camera
    return {
        "name": name,
        "family": pair.law,
        "verdict": worst.value,
        "stage": broken["stage"] if broken else None,
        "item": about["implicates"][0] if broken else None,
        "reason": _reason(reports, broken),
        "stresses": words,
        "covers": list(about["implicates"]),
        "planned": len(checks),
        "seconds": 0.0,
        "reproduce": f"rayproof laws {pair.law} {pair.case.name}",
        "scene": write_scene(folder, case),
        "picture": None,
        "width": camera.width,
        "height": camera.height,
        "lights": len(case.scene.lights),
        "shapes": [type(shape).__name__ for shape in case.scene.shapes],
        "settings": {},
        "renders": _renders(folder, name, reports, request) if exhibit else [],
        "ran": {one.configuration: list(about["implicates"]) for one in reports},
        "unsupported": [],
        "notes": [{"reference": REFERENCE, "note": f"{exhibit.what}: the law is what it says of that"}]
        if exhibit
        else [],
        "checks": checks,
        "expectations": [],
        "adjudication": {},
        "pixels": None,
        "masks": None,
    }


def _reason(reports: Sequence[LawReport], broken: CheckRecord | None) -> str:
    if broken is not None:
        return str(broken["reason"])
    said = [one.error or one.unsupported for one in reports if one.error or one.unsupported]
    return str(said[0]) if said else ""


def _checks(report: LawReport) -> list[CheckRecord]:
    """Return a check for each stage: the worst of its relations."""
    if report.error is not None or not any(one.examined for one in report.judged):
        why = report.error or report.unsupported or "The law has nothing to say of this scene."
        outcome = Outcome.ERROR if report.error is not None else Outcome.UNSUPPORTED
        return [_check(report, str(LAWS.about(report.law)["stage"]), outcome, why, None)]
    found = []
    for stage in Stage:
        some = [one for one in report.judged if one.stage is stage and one.examined]
        if some:
            worst = max(some, key=lambda one: (one.alarm, one.worst))
            outcome = Outcome.FAIL if worst.alarm else Outcome.PASS
            found.append(_check(report, stage.value, outcome, worst.what if worst.alarm else "", worst))
    return found


def _check(report: LawReport, stage: str, outcome: Outcome, why: str, judged: Judged | None) -> CheckRecord:
    measurement: MeasurementRecord | None = None
    if judged is not None:
        measurement = {
            "worst_ratio": judged.worst,
            "pixel": list(judged.pixel) if judged.pixel else None,
            "ours": list(judged.measured),
            "theirs": list(judged.expected),
            "interior": judged.examined - judged.excused,
            "over_inside": judged.outside,
            "edge": judged.excused,
            "differ_at_edge": judged.excused,
        }
    return {
        "configuration": report.configuration,
        "reference": REFERENCE,
        "stage": stage,
        "verdict": outcome.value,
        "reason": why,
        "ratio": judged.worst if judged is not None else 0.0,
        "end_to_end": measurement,
        "continued": None,
        "because": BECAUSE,
    }


def _renders(folder: Path, name: str, reports: Sequence[LawReport], request: LawsRequest) -> list[RenderRecord]:
    """Write the images of the subject and what the law says of them; return the record's renders."""
    found = []
    # Of numbers that are no stage's image, such as a matrix or one pixel's sum, there is nothing to show.
    shown = [one for one in reports if one.exhibit and one.exhibit.measured]
    chosen = next((one for one in shown if one.alarms), next(iter(shown), None))
    if chosen is None or chosen.exhibit is None:
        return []
    lights = len(chosen.exhibit.changed.lights)
    renderer = request.subject.renderer(chosen.configuration)
    both = ((renderer, chosen.configuration, chosen.exhibit.measured), (REFERENCE, None, chosen.exhibit.expected))
    for who, configuration, images in both:
        path = Path("images", name, f"{who.replace('/', '+')}.exr")
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        write_answers(folder / path, images, lights=lights, comments=f"{name}: {chosen.exhibit.what}")
        found.append(
            {
                "renderer": who,
                "configuration": configuration,
                "seconds": 0.0,
                "image": path.as_posix(),
                "error": None,
                "cached": False,
            }
        )
    return found
