"""The page's data that are not of a single run: history, comparison of two runs, comparison of two formulas."""

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
# The keys of a case in the comparison of two runs that the page shows.
ROW = ("case", "before", "after", "stage", "worst", "pixels", "seconds", "stands_out")


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write history/series.js, the points of every case; remove it if the run has no history."""
    path = folder / DATA
    if "history" not in results:
        path.unlink(missing_ok=True)
        return []
    return [write_text(path, script(DATA, pack_json(results["history"]["cases"])))]


def history_front(results: RunRecord) -> dict[str, Any] | None:
    """Return the part of the history that is in the page itself, or None without a history."""
    if "history" not in results:
        return None
    history = results["history"]
    return {"file": history["file"], "run": history["run"], "worse": history["worse"], "data": DATA}


def comparison_front(results: RunRecord) -> dict[str, Any] | None:
    """Return the page's data on the comparison of two runs, or None if it is missing or malformed."""
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
        isinstance(seconds, list)
        and len(seconds) == 3
        and (worst is None or all(isinstance(side, list) for side in sides))
    )


def _is_listed(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(entry, list) and len(entry) == 2 for entry in value)


NAME = "comparison.json"
# The keys of a comparison, and of its families, that the page shows unchanged.
CONTEST = ("base", "candidate", "verdict", "outcome", "repetitions", "stages", "faults")
FAMILY = (
    "family", "stress", "outcome", "scenes", "pixels", "digits_gained", "digits_interval", "time_ratio",
    "time_interval", "nanoseconds_per_ray",
)  # fmt: skip


def contest(folder: Path) -> dict[str, Any] | None:
    """Return the page's data on a comparison of two formulas, or None if it is missing or malformed."""
    try:
        compared = json.loads((folder / NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not _is_comparison(compared):
        return None
    control, families = (
        compared.get("control"),
        [_family(family) for family in compared["families"] if _is_family(family)],
    )
    # A comparison of two runs has no control; `rayproof report A B` writes a separate report of it.
    if not isinstance(control, dict) or not families:
        return None
    return {key: compared.get(key) for key in CONTEST} | {"control": control.get("verdict"), "families": families}


def _is_comparison(content: Any) -> TypeGuard[FormulaComparisonRecord]:
    """Return whether a file's content is a comparison, without validating its families."""
    return isinstance(content, dict) and isinstance(content.get("families"), list)


def _is_family(family: Any) -> bool:
    return isinstance(family, dict) and all(
        family.get(key) is None or (isinstance(family[key], list) and len(family[key]) == 2)
        for key in ("digits_interval", "time_interval", "nanoseconds_per_ray")
    )


def _family(record: FamilyRecord) -> dict[str, Any]:
    """Return the page's data on a family; `wrong` is the wrong pixels of the base, of the candidate, and p."""
    wrong = record.get("wrong")
    counts = [wrong.get("base"), wrong.get("candidate"), wrong.get("p")] if isinstance(wrong, dict) else []
    return {key: record.get(key) for key in FAMILY} | {"wrong": counts}
