"""How the last run stands in its history: what became worse, in sentences."""

from collections.abc import Sequence

import numpy as np

from rayproof.reports.results.json_numbers import at_worst
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import WorseRecord
from rayproof.reports.runs.history.series import WORSE_ERROR, WORSE_TIME, Point, Series
from rayproof.reports.runs.history.steps import FEWEST, NORMAL

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
