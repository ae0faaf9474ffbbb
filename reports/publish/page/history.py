"""history/: how the run stands among those before it, as `reports.runs.history.standing` told its results."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypedDict

from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.float_codec import pack_json
from rayproof.reports.results.image_script import script
from rayproof.reports.results.records import HistoryRecord, RunRecord, WorseRecord

DATA = "history/series.js"


class HistoryFront(TypedDict):
    """What the page holds of the history from the beginning: all but the series, which are in a script."""

    file: str | None
    run: int | None
    worse: list[WorseRecord]
    data: str


def publish(folder: Path, results: RunRecord) -> list[Path]:
    """Write history/series.js: points and steps of every case; nothing where the run keeps no history."""
    path = folder / DATA
    if (history := history_of(results)) is None:
        path.unlink(missing_ok=True)
        return []
    return [write_text(path, script(DATA, pack_json(history["cases"])))]


def history_front(results: RunRecord) -> HistoryFront | None:
    """Return what the page holds of the history from the beginning, or None without one."""
    if (history := history_of(results)) is None:
        return None
    return {"file": history.get("file"), "run": history.get("run"), "worse": history["worse"], "data": DATA}


def history_of(results: RunRecord) -> HistoryRecord | None:
    """Return a run's history if it has one in the shape that docs/report.md tells; None otherwise."""
    history = results.get("history")
    if not isinstance(history, Mapping):
        return None
    cases, worse = history.get("cases"), history.get("worse")
    if not isinstance(cases, Mapping) or not isinstance(worse, list) or not all(map(_drawn, cases.values())):
        return None
    return {**history, "worse": [entry for entry in worse if isinstance(entry, Mapping)]}


def _drawn(series: Any) -> bool:
    """Return whether a case's points and steps are lists of the lengths that the page draws."""
    return isinstance(series, Mapping) and all(
        isinstance(rows := series.get(key), list) and all(isinstance(row, list) and len(row) == length for row in rows)
        for key, length in (("points", 5), ("error_steps", 2), ("time_steps", 2))
    )
