"""The comparison of two runs in a results folder that `rayproof report A B` made, for the page to show."""

from collections.abc import Mapping
from typing import Any, TypedDict

from rayproof.reports.results.records import (
    ComparedCheckRecord,
    ComparedRunRecord,
    ComparisonRowRecord,
    Number,
    RunRecord,
)


class ComparisonFrontRow(TypedDict):
    """What became of a case."""

    case: str
    before: str | None
    after: str | None
    stage: str | None
    worst: ComparedCheckRecord | None
    pixels: int | None
    seconds: list[Number | None]
    stands_out: int | None


class ComparisonFront(TypedDict):
    """What the page shows of two runs."""

    base: ComparedRunRecord
    candidate: ComparedRunRecord
    renderers: dict[str, str]
    appeared: list[list[str]]
    vanished: list[list[str]]
    sentence: str | None
    rows: list[ComparisonFrontRow]


def comparison_front(results: RunRecord) -> ComparisonFront | None:
    """Return what the page shows of the comparison, or None where there is none in the shape of docs/report.md."""
    found = results.get("comparison")
    if not isinstance(found, Mapping):
        return None
    base, candidate, renderers, rows = (found.get(key) for key in ("base", "candidate", "renderers", "rows"))
    if not all(isinstance(item, Mapping) for item in (base, candidate, renderers)) or not isinstance(rows, list):
        return None
    if not all(map(_is_row, rows)) or not all(_is_listed(found.get(key)) for key in ("appeared", "vanished")):
        return None
    return {
        "base": found["base"],
        "candidate": found["candidate"],
        "renderers": found["renderers"],
        "appeared": found["appeared"],
        "vanished": found["vanished"],
        "sentence": found.get("sentence"),
        "rows": [_row(row) for row in found["rows"]],
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
