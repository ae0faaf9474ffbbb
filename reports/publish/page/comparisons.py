"""The page's data beside a run: history, comparison of two runs, comparison of two formulas."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeGuard

from rayproof.reports.results.files import write_text
from rayproof.reports.results.float_codec import pack_json
from rayproof.reports.results.images import script
from rayproof.reports.results.records import (
    RunRecord,
)

if TYPE_CHECKING:
    from rayproof.reports.studies.compare.records import FamilyRecord, FormulaComparisonRecord

DATA = "history/series.js"
# The keys of a case of two runs that the page shows.
ROW = ("case", "before", "after", "stage", "worst", "pixels", "seconds", "stands_out")


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write history/series.js: the points of every case; nothing where the run keeps no history."""
    path = folder / DATA
    if "history" not in results:
        path.unlink(missing_ok=True)
        return []
    return [write_text(path, script(DATA, pack_json(results["history"]["cases"])))]


def history_front(results: RunRecord) -> dict[str, Any] | None:
    """Return what the page holds of the history from the beginning, or None without one."""
    if "history" not in results:
        return None
    history = results["history"]
    return {"file": history["file"], "run": history["run"], "worse": history["worse"], "data": DATA}


def comparison_front(results: RunRecord) -> dict[str, Any] | None:
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
        "rows": [{key: row.get(key) for key in ROW} for row in compared["rows"]],
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
# The keys of a comparison, and of its families, that the page shows as they are.
CONTEST = ("base", "candidate", "verdict", "outcome", "repetitions", "stages", "faults")
FAMILY = (
    "family", "stress", "outcome", "scenes", "pixels", "digits_gained", "digits_interval", "time_ratio",
    "time_interval", "nanoseconds_per_ray",
)  # fmt: skip


def contest(folder: Path) -> dict[str, Any] | None:
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
    return {key: compared.get(key) for key in CONTEST} | {"control": control.get("verdict"), "families": families}


def _is_comparison(found: Any) -> TypeGuard[FormulaComparisonRecord]:
    """Return whether a file's content is a comparison; its parts are looked at one by one."""
    return isinstance(found, dict) and isinstance(found.get("families"), list)


def _is_family(one: Any) -> bool:
    return isinstance(one, dict) and all(
        one.get(key) is None or (isinstance(one[key], list) and len(one[key]) == 2)
        for key in ("digits_interval", "time_interval", "nanoseconds_per_ray")
    )


def _family(record: FamilyRecord) -> dict[str, Any]:
    """Return what the page shows of a family; of wrong pixels those of the base, of the candidate, and p."""
    wrong = record.get("wrong")
    counts = [wrong.get("base"), wrong.get("candidate"), wrong.get("p")] if isinstance(wrong, dict) else []
    return {key: record.get(key) for key in FAMILY} | {"wrong": counts}
