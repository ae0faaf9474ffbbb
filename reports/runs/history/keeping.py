"""Keep a run in its history, and tell the run's own results how they stand in it."""

from pathlib import Path

from rayproof.reports.results.records import RunRecord, SeriesRecord
from rayproof.reports.runs.history.database import append, opened
from rayproof.reports.runs.history.revisions import revision
from rayproof.reports.runs.history.series import Series, read_series
from rayproof.reports.runs.history.standing import worse

SHOWN = 50  # runs of each case that a report draws


def keep(path: Path, results: RunRecord) -> list[str]:
    """Append `results` to the history `path`, put `history` into them, and return what became worse, in sentences.

    Raises:
        HistoryError: the file cannot be used.

    """
    run = append(path, results, revision())
    with opened(path) as connection:
        series = read_series(connection, str(results.get("subject", "tracer")))
    found = worse(series, run)
    results["history"] = {"file": path.name, "run": run, "worse": found, "cases": {s.name: drawn(s) for s in series}}
    return [entry["sentence"] for entry in found]


def drawn(series: Series) -> SeriesRecord:
    """Return what a report draws of a case: its last points and the steps among them, by run."""
    points = series.points[-SHOWN:]
    return {
        "points": [(p.run, p.revision[:10], p.verdict, p.ratio, p.seconds) for p in points],
        "error_steps": [(series.points[step.at].run, step.factor) for step in series.error_steps],
        "time_steps": [(series.points[step.at].run, step.factor) for step in series.time_steps],
    }
