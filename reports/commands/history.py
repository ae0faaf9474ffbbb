"""`rayproof report history`: error and time of each case over the runs that were kept, with the steps in both."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line

if TYPE_CHECKING:
    from rayproof.reports.history.database import Series, Step
    from rayproof.reports.results.records import WorseRecord

USUAL = "rayproof-history.sqlite"
VARIABLE = "RAYPROOF_HISTORY"
KeptRun = tuple[int, str, str, str, float]  # a row of the table of runs: number, start, revision, verdict, seconds


class RunEntry(TypedDict):
    """A run that the history has."""

    run: int
    started: str
    revision: str
    verdict: str
    seconds: float


class PointEntry(TypedDict):
    """One run's result of a case."""

    run: int
    started: str
    revision: str
    verdict: str
    ratio: float | None
    stage: str
    place: str
    seconds: float
    machine: str


class StepEntry(TypedDict):
    """A change of level, and the run that it came with."""

    at: int
    before: float
    after: float
    run: int


class SeriesEntry(TypedDict):
    """A case over all runs that have it."""

    name: str
    points: list[PointEntry]
    error_steps: list[StepEntry]
    time_steps: list[StepEntry]


class HistoryDocument(TypedDict):
    """What `rayproof report history --json` writes."""

    runs: list[RunEntry]
    cases: list[SeriesEntry]
    worse: "list[WorseRecord]"


def history(*selectors: str, history: Path | None = None, subject: str = "tracer", json: Path | None = None) -> int:
    """Show error and time of each case over the kept runs, with their steps.

    Runs are kept by `rayproof run --history FILE`.

    Parameters
    ----------
    selectors
        Families, family/case names or patterns. Default: every case that the history has.
    history
        The history file. Default: $RAYPROOF_HISTORY, or rayproof-history.sqlite in the current folder.
    subject
        The renderer whose history is shown: tracer, or the value of --subject.
    json
        Also write every point of every series to this file.

    """
    from fnmatch import fnmatchcase

    from rayproof.reports.history.database import opened, read_series, storable, worse

    path = history or Path(os.environ.get(VARIABLE, USUAL))
    with told_in_one_line(), opened(path) as connection:
        runs = connection.execute(
            "SELECT id, started, revision, verdict, seconds FROM runs WHERE subject = ? ORDER BY id", storable(subject)
        ).fetchall()
        known = read_series(connection, subject)
    chosen = [
        each
        for each in known
        if not selectors or any(fnmatchcase(each.name, s) or each.name.split("/")[0] == s for s in selectors)
    ]
    if not runs:
        raise UsageError(f"{path} has no run of {subject}")
    if not chosen:
        raise UsageError(f"{path} has no case called {' or '.join(selectors)}")
    last = runs[-1][0]
    found = worse(chosen, last)
    write_json(json, document(runs, chosen, found))
    rows = [row(each) for each in sorted(chosen, key=lambda each: -(each.points[-1].ratio or 0.0))]
    show_table(
        f"{len(chosen)} cases over {len(runs)} runs of {subject}",
        ["case", "runs", "verdict", "error / limit", "steps in error", "time [s]", "steps in time"],
        rows,
    )
    for entry in found:
        say(f"worse than its history: {entry['sentence']}")
    return 0


def row(series: "Series") -> list[str]:
    """Return a case's row: the last value, and every step with the run at which it came."""
    now = series.points[-1]
    told = [
        ", ".join(f"x{step.factor:.3g} at run {series.points[step.at].run}" for step in found) or "-"
        for found in (series.error_steps, series.time_steps)
    ]
    return [
        series.name,
        str(len(series.points)),
        now.verdict,
        "-" if now.ratio is None else f"{now.ratio:.3g}",
        told[0],
        f"{now.seconds:.3g}",
        told[1],
    ]


def document(runs: "list[KeptRun]", chosen: "list[Series]", found: "list[WorseRecord]") -> HistoryDocument:
    """Return the history as JSON data."""
    from dataclasses import asdict

    return {
        "runs": [
            {"run": run, "started": started, "revision": revision, "verdict": verdict, "seconds": seconds}
            for run, started, revision, verdict, seconds in runs
        ],
        "cases": [
            {
                "name": one.name,
                "points": [PointEntry(**asdict(point)) for point in one.points],
                "error_steps": [_step(one, step) for step in one.error_steps],
                "time_steps": [_step(one, step) for step in one.time_steps],
            }
            for one in chosen
        ],
        "worse": found,
    }


def _step(one: "Series", step: "Step") -> StepEntry:
    return {"at": step.at, "before": step.before, "after": step.after, "run": one.points[step.at].run}
