"""How large a case's errors are: the largest over its limit, of one check or of all."""

from collections.abc import Iterable
from typing import Any

from rayproof.reports.results.json_numbers import at_worst, number
from rayproof.reports.results.outcomes import MEASURED, Outcome
from rayproof.reports.results.records import CaseRecord, CheckRecord

# Of these a check may have come to nothing; the camera's have no measurement though they were made.
UNMEASURED = frozenset(Outcome) - MEASURED


def worst_ratio(case: CaseRecord) -> float | None:
    """Return the case's largest error over its limit, NaN counted as largest; None without any.

    What a list has of a case holds it already.
    """
    return number(case["worst_ratio"]) if "worst_ratio" in case else worst_of(case.get("checks", []))


def worst_of(checks: Iterable[CheckRecord]) -> float | None:
    """Return the largest error over its limit of some checks, NaN counted as largest; None without any."""
    known = [at_worst(ratio) for check in checks if (ratio := number(ratio_of(check))) is not None]
    return max(known, default=None)


def ratio_of(check: CheckRecord) -> Any:
    """Return a check's error over its limit as results.json has it: the larger one where it was judged twice.

    None where nothing was measured, for which results.json has the ratio 0.
    """
    measured = check.get("end_to_end") or check.get("continued")
    if not measured and check.get("verdict") in UNMEASURED:
        return None
    return check.get("ratio", (check.get("end_to_end") or {}).get("worst_ratio"))
