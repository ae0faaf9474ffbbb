"""results.json without what repeats: texts that derive limits, each once, and nothing that goes without saying.

Tens of thousands of checks share a few hundred derivations, and a third of a measurement is counts of what never was.
"""

from collections.abc import Mapping
from typing import Any, Literal, cast

from rayproof.reports.results.records import CaseRecord, CheckRecord, MeasurementRecord, RunRecord

TABLE = "derivations"
MEASUREMENTS: tuple[Literal["end_to_end", "continued"], ...] = ("end_to_end", "continued")
# Of a measurement: left out where it is 0.
COUNTS = (
    "interior", "over_inside", "edge", "differ_at_edge", "wrong_at_edge", "in_window", "differ_in_window", "hit_miss",
    "nan", "inf", "flagged",
)  # fmt: skip


def compact(record: CaseRecord, places: dict[str, int]) -> CaseRecord:
    """Return a case's record as it is written; texts become their places among `places`, which new ones join."""
    checks = record.get("checks")
    return {**record, "checks": [_short(check, places) for check in checks]} if isinstance(checks, list) else record


def compact_case(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return a case's record the same way, with a table of its own; html/expand.js is the inverse."""
    places: dict[str, int] = {}
    return {"checks": [], **compact(cast("CaseRecord", record), places), TABLE: list(places)}


def expand(results: RunRecord) -> None:
    """Put back what `compact` left out, in place; results that leave nothing out stay as they are."""
    table = results.pop(TABLE, None)
    for case in results["cases"]:
        for check in case.get("checks", []):
            place = check.get("because")
            if isinstance(place, int) and not isinstance(place, bool):
                check["because"] = str(table[place]) if table and 0 <= place < len(table) else ""
            check.setdefault("reason", "")
            for name in MEASUREMENTS:
                measured = check.setdefault(name, None)
                if isinstance(measured, dict):
                    _complete(measured)


def _short(check: CheckRecord, places: dict[str, int]) -> CheckRecord:
    if not isinstance(check, Mapping):
        return check
    left = check.copy()
    if left.get("reason") == "":
        del left["reason"]
    if isinstance(because := left.get("because"), str):
        left["because"] = places.setdefault(because, len(places))
    for name in MEASUREMENTS:
        measured: MeasurementRecord | None = left.get(name)
        if measured is None:
            left.pop(name, None)
        elif isinstance(measured, Mapping):
            left[name] = _terse(measured)
    return left


def _terse(measured: MeasurementRecord) -> MeasurementRecord:
    left = measured.copy()
    for name in COUNTS:
        if left.get(name) == 0:
            del left[name]
    if left.get("worst_inside") == left.get("worst_ratio"):
        left.pop("worst_inside", None)
    return left


def _complete(measured: MeasurementRecord) -> None:
    for name in COUNTS:
        measured.setdefault(name, 0)
    measured.setdefault("worst_inside", measured.get("worst_ratio"))
