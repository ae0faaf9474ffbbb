"""ctrf.json: the Common Test Report Format (ctrf.io, specification 0.0.0), one test per case."""

from datetime import datetime
from pathlib import Path
from typing import Any, NotRequired, TypedDict

from rayproof.reports.publish.formats.junit import MOST_LISTED, left_out
from rayproof.reports.results.atomic import replacing
from rayproof.reports.results.case_table import briefs
from rayproof.reports.results.headline import blame, cause_of, headline, shouts
from rayproof.reports.results.json_numbers import as_json, legible, legible_json
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.ratios import worst_ratio
from rayproof.reports.results.records import CaseRecord, RunRecord

_STATUSES = {
    Outcome.PASS: "passed",
    Outcome.WARN: "passed",
    Outcome.FAIL: "failed",
    Outcome.REFERENCE_SUSPECT: "failed",
    Outcome.UNDECIDED: "skipped",
    Outcome.UNSUPPORTED: "skipped",
    Outcome.ERROR: "other",
    Outcome.MISSING: "other",
}


class CtrfAttachment(TypedDict):
    """A file that belongs to a test."""

    name: str
    contentType: str
    path: str


class CtrfExtra(TypedDict):
    """What only this harness says of a case."""

    stage: str | None
    item: str | None
    blamed_items: list[str]
    worst_ratio: float | None
    reproduce: str | None


class CtrfTest(TypedDict):
    """A test, as the format has it."""

    name: str
    status: str
    rawStatus: str
    duration: int  # ms
    suite: list[str]
    tags: list[str]
    message: NotRequired[str]
    attachments: NotRequired[list[CtrfAttachment]]
    extra: NotRequired[CtrfExtra]


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write ctrf.json; what must be shouted is its first field and its report name."""
    loud = shouts(results)
    few = len(results["cases"]) <= MOST_LISTED
    counts: dict[str, int] = dict.fromkeys(("passed", "failed", "skipped", "pending", "other"), 0)
    families = set()
    for case in briefs(results["cases"]):
        counts[_STATUSES[Outcome(case["verdict"])]] += 1
        families.add(case["family"])
    start, seconds = _milliseconds(results.get("started")), float(results.get("seconds") or 0)
    extra = {"shouts": loud, "verdict": headline(results), "checks": results["checks"]}
    if not few:
        extra["left_out"] = left_out(counts["passed"])
    document = {
        "extra": extra,
        "reportFormat": "CTRF",
        "specVersion": "0.0.0",
        "generatedBy": f"rayproof {results.get('rayproof', '')}".strip(),
        "results": {
            "tool": {"name": "rayproof", "version": str(results.get("rayproof", ""))},
            "summary": {
                "tests": len(results["cases"]),
                **counts,
                "suites": len(families),
                "start": start,
                "stop": start + round(seconds * 1000),
            },
            "environment": {
                "reportName": " ".join([*loud, "rayproof"]),
                "appName": "rayproof",
                "extra": dict(results.get("environment", {})),
            },
            "tests": [],
        },
    }
    # No indentation: the first line is the whole document, and the shout its beginning.
    head, tail = legible_json(as_json(document)).rsplit("[]", 1)
    path = folder / "ctrf.json"
    with replacing(path) as draft, draft.open("w", encoding="utf-8", newline="\n") as file:
        between = f"{head}["
        for case in briefs(results["cases"]):
            if few or Outcome(case["verdict"]) not in (Outcome.PASS, Outcome.WARN):
                file.write(between + legible_json(as_json(_test(case, cause_of(results, case)))))
                between = ","
        file.write(("" if between == "," else between) + f"]{tail}\n")
    return [path]


def _test(case: CaseRecord, cause: str) -> CtrfTest:
    test: CtrfTest = {
        "name": legible(case["name"]),
        "status": _STATUSES[Outcome(case["verdict"])],
        "rawStatus": case["verdict"],
        "duration": round(float(case.get("seconds") or 0) * 1000),
        "suite": [legible(case["family"])],
        "tags": [legible(item) for item in case.get("covers", [])],
    }
    if message := ": ".join(filter(None, [cause or blame(case), legible(case.get("reason") or "")])):
        test["message"] = message
    if picture := case.get("picture"):
        test["attachments"] = [{"name": "picture of the scene", "contentType": "image/png", "path": picture}]
    test["extra"] = {
        "stage": case.get("stage"),
        "item": case.get("item"),
        "blamed_items": case.get("blamed_items") or [],
        "worst_ratio": worst_ratio(case),
        "reproduce": case.get("reproduce"),
    }
    return test


def _milliseconds(started: Any) -> int:
    try:
        return round(datetime.fromisoformat(str(started)).timestamp() * 1000)
    except ValueError:
        return 0
