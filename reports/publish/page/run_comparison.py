"""The comparison of two runs in a results folder that `rayproof report A B` made, for the page to show."""

from collections.abc import Mapping
from typing import Any

from rayproof.reports.results.records import RunRecord

_OF_A_ROW = ("case", "before", "after", "stage", "worst", "pixels", "seconds", "stands_out")


def comparison_front(results: RunRecord) -> dict[str, Any] | None:
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
        **{key: found[key] for key in ("base", "candidate", "renderers", "appeared", "vanished")},
        "sentence": found.get("sentence"),
        "rows": [{key: row.get(key) for key in _OF_A_ROW} for row in rows],
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
