"""How large a case's errors are, over their limits, and what chance makes of the signs of many."""

import math
from collections.abc import Iterable
from typing import Any

from rayproof.reports.results.json_numbers import at_worst, number
from rayproof.reports.results.outcomes import MEASURED, Outcome
from rayproof.reports.results.records import CaseRecord, CheckRecord

# Of these a check may have come to nothing; the camera's have no measurement though they were made.
UNMEASURED = frozenset(Outcome) - MEASURED

# The sign test of factors that many pixels, or many cases, share.
CHANCE = 2e-9  # of accusing a correct renderer, for each group and channel
LEAST_DISTINCT = 30  # so many signs are all alike with a probability of 2^-29


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


def least_share(distinct: int) -> float:
    """Return the share of a sample below its median that chance leaves on either side of it, but for `CHANCE`.

    Of so many independent signs at most half are expected to be positive; Hoeffding's inequality (1963, theorem 1).
    """
    return max(0.0, 0.5 - math.sqrt(math.log(2 / CHANCE) / (2 * distinct)))
