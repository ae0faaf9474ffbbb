"""How the last run stands in its history: what became worse, in sentences."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rayproof.reports.results.files import at_worst
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord, SeriesRecord, WorseRecord
from rayproof.reports.runs.history.database import (
    FEWEST,
    NORMAL,
    WORSE_ERROR,
    WORSE_TIME,
    Point,
    Series,
    append,
    opened,
    read_series,
    revision,
)

LOUD = 4.0  # standard deviations; of 151 cases one in a hundred runs is flagged by chance


def worse(series: Sequence[Series], run: int) -> list[WorseRecord]:
    """Return what is worse in `run` than before: `case`, `what` (verdict, error or time), `sentence`, `factor`."""
    found = []
    for one in series:
        if one.points[-1].run == run and len(one.points) > 1:
            found += [entry for entry in (_verdict(one), _error(one), _time(one)) if entry is not None]
    return sorted(found, key=lambda entry: -at_worst(entry["factor"]))


def _entry(one: Series, what: str, factor: float, sentence: str) -> WorseRecord:
    return {"case": one.name, "what": what, "factor": factor, "sentence": f"{one.name}: {sentence}"}


def _since(point: Point) -> str:
    return f"run {point.run}{f' ({point.revision[:10]})' if point.revision else ''}"


def _verdict(one: Series) -> WorseRecord | None:
    order = list(Outcome)
    before, now = one.points[-2], one.points[-1]
    if order.index(Outcome(now.verdict)) <= order.index(Outcome(before.verdict)):
        return None
    return _entry(one, "verdict", float("inf"), f"{now.verdict}, was {before.verdict} in {_since(before)}")


def _error(one: Series) -> WorseRecord | None:
    before, now = one.points[-2], one.points[-1]
    # Below a hundredth of the limit an error is nobody's business.
    if now.ratio is None or before.ratio is None or now.ratio < 0.01 or not now.ratio > WORSE_ERROR * before.ratio:
        return None
    factor = now.ratio / before.ratio if before.ratio else float("inf")
    said = (
        f"worst error / limit {now.ratio:.3g} at {now.stage} ({now.place}), was {before.ratio:.3g} in {_since(before)}"
    )
    return _entry(one, "error", factor, said)


def _time(one: Series) -> WorseRecord | None:
    now = one.points[-1]
    earlier = [point.seconds for point in one.points[:-1] if point.machine == now.machine and point.seconds > 0]
    if one.time_steps:  # only what came after the last step is the level of today
        start = one.time_steps[-1].at
        earlier = [p.seconds for p in one.points[start:-1] if p.machine == now.machine and p.seconds > 0] or earlier
    if len(earlier) < FEWEST or not now.seconds > 0:
        return None
    logarithms = np.log(earlier)
    level = float(np.median(logarithms))
    noise = NORMAL * float(np.median(np.abs(logarithms - level)))
    excess = float(np.log(now.seconds)) - level
    if excess <= max(LOUD * noise, np.log(WORSE_TIME)):
        return None
    said = f"{now.seconds:.3g} s, median of {len(earlier)} runs before {np.exp(level):.3g} s"
    return _entry(one, "time", float(np.exp(excess)), said)


# Keep a run in its history, and tell the run's own results how they stand in it.


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
