"""results.json without what repeats: texts that derive limits, each once, and nothing that goes without saying.

Tens of thousands of checks share a few hundred derivations, and a third of a measurement is counts of what never was.
"""

from collections.abc import Mapping
from typing import Any, cast

from rayproof.reports.results.records import MeasurementRecord, RunRecord

TABLE = "derivations"
MEASUREMENTS = ("end_to_end", "continued")
# Of a measurement: left out where it is 0.
COUNTS = (
    "interior", "over_inside", "edge", "differ_at_edge", "wrong_at_edge", "in_window", "differ_in_window", "hit_miss",
    "nan", "inf", "flagged",
)  # fmt: skip


def compact(results: RunRecord) -> RunRecord:
    """Return `results` as they are written; nothing is changed."""
    places: dict[str, int] = {}
    cases = [
        {**case, "checks": [_short(check, places) for check in case["checks"]]}
        if isinstance(case.get("checks"), list)
        else case
        for case in results["cases"]
    ]
    rest = {key: value for key, value in results.items() if key not in ("cases", TABLE)}
    return cast(RunRecord, {**rest, TABLE: list(places), "cases": cases})


def compact_case(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return a case's record the same way, with a table of its own; html/expand.js is the inverse."""
    places: dict[str, int] = {}
    checks = [_short(check, places) for check in record.get("checks", [])]
    return {**record, "checks": checks, TABLE: list(places)}


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


def _short(check: Any, places: dict[str, int]) -> Any:
    if not isinstance(check, Mapping):
        return check
    left = dict(check)
    if left.get("reason") == "":
        del left["reason"]
    if isinstance(left.get("because"), str):
        left["because"] = places.setdefault(left["because"], len(places))
    for name in MEASUREMENTS:
        measured = left.get(name)
        if isinstance(measured, Mapping):
            left[name] = _terse(measured)
        elif measured is None:
            left.pop(name, None)
    return left


def _terse(measured: Mapping[str, Any]) -> dict[str, Any]:
    left = dict(measured)
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
