"""The page's data beside a run: history, comparison of two runs, comparison of two formulas."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, TypeGuard

from rayproof.reports.results.case_records import ComparedCheckRecord, Number
from rayproof.reports.results.files import write_text
from rayproof.reports.results.float_codec import pack_json
from rayproof.reports.results.images import script
from rayproof.reports.results.records import (
    ComparedRunRecord,
    ComparisonRowRecord,
    RunRecord,
    WorseRecord,
)

if TYPE_CHECKING:
    from rayproof.reports.studies.compare.records import FamilyRecord, FormulaComparisonRecord
    from rayproof.reports.studies.compare.statistics import Interval

DATA = "history/series.js"


class HistoryFront(TypedDict):
    """What the page holds of the history from the beginning: all but the series, which are in a script."""

    file: str
    run: int
    worse: list[WorseRecord]
    data: str


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write history/series.js: the points of every case; nothing where the run keeps no history."""
    path = folder / DATA
    if "history" not in results:
        path.unlink(missing_ok=True)
        return []
    return [write_text(path, script(DATA, pack_json(results["history"]["cases"])))]


def history_front(results: RunRecord) -> HistoryFront | None:
    """Return what the page holds of the history from the beginning, or None without one."""
    if "history" not in results:
        return None
    history = results["history"]
    return {"file": history["file"], "run": history["run"], "worse": history["worse"], "data": DATA}


class ComparisonFrontRow(TypedDict):
    """The result of a case in both runs."""

    case: str
    before: str | None
    after: str | None
    stage: str | None
    worst: ComparedCheckRecord | None
    pixels: int | None
    seconds: list[Number | None]
    stands_out: int | None


class ComparisonFront(TypedDict):
    """The part of two runs that the page shows."""

    base: ComparedRunRecord
    candidate: ComparedRunRecord
    renderers: dict[str, str]
    appeared: list[list[str]]
    vanished: list[list[str]]
    sentence: str | None
    rows: list[ComparisonFrontRow]


def comparison_front(results: RunRecord) -> ComparisonFront | None:
    """Return what the page shows of the comparison, or None where there is none in the shape of docs/report.md."""
    compared = results.get("comparison")
    if not isinstance(compared, Mapping):
        return None
    base, candidate, renderers, rows = (compared.get(key) for key in ("base", "candidate", "renderers", "rows"))
    if not all(isinstance(item, Mapping) for item in (base, candidate, renderers)) or not isinstance(rows, list):
        return None
    if not all(map(_is_row, rows)) or not all(_is_listed(compared.get(key)) for key in ("appeared", "vanished")):
        return None
    return {
        "base": compared["base"],
        "candidate": compared["candidate"],
        "renderers": compared["renderers"],
        "appeared": compared["appeared"],
        "vanished": compared["vanished"],
        "sentence": compared.get("sentence"),
        "rows": [_row(row) for row in compared["rows"]],
    }


def _row(row: ComparisonRowRecord) -> ComparisonFrontRow:
    """Return of a case's row what the page shows."""
    return {
        "case": row.get("case"),
        "before": row.get("before"),
        "after": row.get("after"),
        "stage": row.get("stage"),
        "worst": row.get("worst"),
        "pixels": row.get("pixels"),
        "seconds": row["seconds"],
        "stands_out": row.get("stands_out"),
    }


def _is_row(row: Any) -> bool:
    if not isinstance(row, Mapping):
        return False
    worst, seconds = row.get("worst"), row.get("seconds")
    sides = [None, None] if not isinstance(worst, Mapping) else [worst.get("before"), worst.get("after")]
    return (
        isinstance(seconds, list) and len(seconds) == 3 and (worst is None or all(isinstance(s, list) for s in sides))
    )


def _is_listed(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(entry, list) and len(entry) == 2 for entry in value)


NAME = "comparison.json"


class ContestFamily(TypedDict):
    """A family of cases."""

    family: str
    stress: bool
    outcome: str
    scenes: int
    pixels: int
    digits_gained: float | None
    digits_interval: Interval | None
    time_ratio: float
    time_interval: Interval
    nanoseconds_per_ray: tuple[float, float]
    wrong: list[float]  # pixels of the base, of the candidate, and p; empty where nobody says


class Contest(TypedDict):
    """What the page shows."""

    base: str
    candidate: str
    verdict: str
    outcome: str
    repetitions: int
    stages: list[str]
    faults: list[str]
    control: str
    families: list[ContestFamily]


def contest(folder: Path) -> Contest | None:
    """Return what the page shows of a comparison of two formulas, or None without one that can be read."""
    try:
        compared = json.loads((folder / NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not _is_comparison(compared):
        return None
    control, families = compared.get("control"), [_family(one) for one in compared["families"] if _is_family(one)]
    # Two runs have no control, and a report of their own: `rayproof report A B`.
    if not isinstance(control, dict) or not families:
        return None
    return {
        "base": compared.get("base"),
        "candidate": compared.get("candidate"),
        "verdict": compared.get("verdict"),
        "outcome": compared.get("outcome"),
        "repetitions": compared.get("repetitions"),
        "stages": compared.get("stages"),
        "faults": compared.get("faults"),
        "control": control.get("verdict"),
        "families": families,
    }


def _is_comparison(found: Any) -> TypeGuard[FormulaComparisonRecord]:
    """Return whether a file's content is a comparison; its parts are looked at one by one."""
    return isinstance(found, dict) and isinstance(found.get("families"), list)


def _is_family(one: Any) -> bool:
    return isinstance(one, dict) and all(
        one.get(key) is None or (isinstance(one[key], list) and len(one[key]) == 2)
        for key in ("digits_interval", "time_interval", "nanoseconds_per_ray")
    )


def _family(record: FamilyRecord) -> ContestFamily:
    wrong = record.get("wrong")
    return {
        "family": record.get("family"),
        "stress": record.get("stress"),
        "outcome": record.get("outcome"),
        "scenes": record.get("scenes"),
        "pixels": record.get("pixels"),
        "digits_gained": record.get("digits_gained"),
        "digits_interval": record.get("digits_interval"),
        "time_ratio": record.get("time_ratio"),
        "time_interval": record.get("time_interval"),
        "nanoseconds_per_ray": record.get("nanoseconds_per_ray"),
        "wrong": [wrong.get("base"), wrong.get("candidate"), wrong.get("p")] if isinstance(wrong, dict) else [],
    }
