"""What became of one case between two runs: every check before and after, and the time of what was under test."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rayproof.reports.results.json_numbers import at_worst, number
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.ratios import ratio_of
from rayproof.reports.results.records import CaseRecord, CheckRecord, ComparedCheckRecord

Case = CaseRecord
ORDER = [outcome.value for outcome in Outcome]  # from the best to the worst
LEAST_RATIO = 0.01  # below a hundredth of its limit an error is nobody's business: changes down there weigh nothing


def paired(before: Sequence[str], after: Sequence[str]) -> dict[str, str]:
    """Return which configuration of the earlier run one of the later answers to: the same name, else the same place.

    Places are those among the ones whose names stand in one run alone, so that no two answer to the same.
    """
    gone, come = ([name for name in one if name not in other] for one, other in ((before, after), (after, before)))
    placed = dict(zip(come, gone, strict=False))
    return {name: placed.get(name, name) for name in after if name in before or name in placed}


def compared(before: Case, after: Case, pairs: Mapping[str, str]) -> list[ComparedCheckRecord]:
    """Return every check that either run made of a case, the largest change first.

    `configuration` is the later run's name of it, `before` and `after` are [verdict, worst error over limit] or null,
    `factor` is by how much the ratio grew, null where it was not measured on both sides.
    """
    named = {value: key for key, value in pairs.items()}
    one = {_key(check, named): _word(check) for check in before.get("checks", [])}
    other = {_key(check, {}): _word(check) for check in after.get("checks", [])}
    rows: list[ComparedCheckRecord] = [
        {
            "configuration": key[0],
            "reference": key[1],
            "stage": key[2],
            "before": one.get(key),
            "after": other.get(key),
            "factor": _factor(one.get(key), other.get(key)),
        }
        for key in dict.fromkeys([*other, *one])
    ]
    return sorted(rows, key=lambda row: -weight(row))


def weight(row: ComparedCheckRecord) -> float:
    """Return how much a check changed: steps of its verdict count most, then decades of its error over limit."""
    before, after = row["before"], row["after"]
    if before is None or after is None:
        return 0.0
    steps = abs(ORDER.index(after[0]) - ORDER.index(before[0]))
    return 100.0 * steps + decades(before[1], after[1])


def decades(before: float | None, after: float | None) -> float:
    """Return by how many decades an error over its limit moved, up or down; at most 99."""
    if before is None or after is None:
        return 0.0
    low, high = sorted(max(value, LEAST_RATIO) for value in (before, after))
    return 0.0 if low == high else min(99.0, math.log10(high) - math.log10(low))


def times(before: Case, after: Case, references: Sequence[Sequence[str]]) -> list[float | None]:
    """Return the seconds of what was under test, before and after, and their quotient; null where not timed.

    `references` are those of both runs.
    """
    sides = [_seconds(case, known) for case, known in zip((before, after), references, strict=True)]
    return [*sides, sides[1] / sides[0] if sides[0] and sides[1] else None]


def ours(case: Case, references: Sequence[str]) -> list[str]:
    """Return the renderers of a case that were under test, in order: who is no reference."""
    witnesses = {*references, *(str(check.get("reference")) for check in case.get("checks", []))}
    names = [str(render.get("renderer")) for render in case.get("renders", [])]
    return [name for name in dict.fromkeys(names) if name not in witnesses]


def _seconds(case: Case, references: Sequence[str]) -> float | None:
    mine = set(ours(case, references))
    known = [number(render.get("seconds")) for render in case.get("renders", []) if str(render.get("renderer")) in mine]
    total = sum(value for value in known if value is not None and math.isfinite(value))
    return total if total > 0 else None


def _key(check: CheckRecord, named: Mapping[str, str]) -> tuple[str, str, str]:
    # A check of means over samples is that of "CONFIGURATION xSAMPLES".
    name, mark, samples = str(check.get("configuration")).partition(" x")
    return f"{named.get(name, name)}{mark}{samples}", str(check.get("reference")), str(check.get("stage"))


def _word(check: CheckRecord) -> list[Any]:
    ratio = number(ratio_of(check))
    return [check["verdict"], None if ratio is None else at_worst(ratio)]


def _factor(before: list[Any] | None, after: list[Any] | None) -> float | None:
    if before is None or after is None or before[1] is None or after[1] is None:
        return None
    if before[1] == after[1]:
        return 1.0
    # Not both of them are 0 or inf: what is divided by inf is 0.
    return after[1] / before[1] if before[1] > 0 else math.inf
