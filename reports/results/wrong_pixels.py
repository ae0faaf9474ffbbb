"""How many pixels of a case are wrong, by how much, and whose they are, in words.

An error over its limit is infinite where the limit is 0, and says nothing about the size of a mistake where the limit
is tiny. What people read are the numbers of wrong pixels and their mean error in the stage's unit.
"""

import math
import re

from rayproof.cases.stages import FACTS, Stage
from rayproof.reports.results.case_records import CaseRecord, Check, Measurement
from rayproof.reports.results.outcomes import Outcome

DISPLAY_NAMES = {"radiance": "Radiance (rtrace)"}  # references whose name is also a word of the field
COUNTED = (Stage.OBJECT, Stage.VISIBILITY)  # whose errors have no size: another object is seen, or another light
MOST_TIMES = 1000.0  # a larger quotient of error and limit is a statement about the limit
_TIMES = re.compile(r" \((inf|nan|[-+.\de]+) times\)")
_AGAINST = re.compile(rf"\b(against|and) ({'|'.join(DISPLAY_NAMES)})\b(?=[,:; ]|$)")


def display_name(reference: str) -> str:
    """Return the name of a reference as people read it: `Radiance (rtrace)` for `radiance`."""
    return DISPLAY_NAMES.get(reference, reference)


def plain_reason(reason: object) -> str:
    """Return a check's or case's reason without quotients that are infinite or huge, with display names."""
    text = _TIMES.sub(lambda match: match[0] if float(match[1]) < MOST_TIMES else "", str(reason or ""))
    return _AGAINST.sub(lambda match: f"{match[1]} {display_name(match[2])}", text)


def deciding_check(case: CaseRecord) -> Check | None:
    """Return the check that decides the verdict: the one of the case's verdict and stage with the most wrong pixels."""
    checks = [
        check
        for check in case.get("checks", [])
        if check.outcome == case["verdict"] and case.get("stage") in (None, check.stage)
    ]
    return max(checks, key=_wrong, default=None)


def wrong_pixels(case: CaseRecord) -> str:
    """Return how many pixels of a case are wrong at its stage, and by how much; empty where none is.

    A brief of a case, as lists have it, contains the sentence already.
    """
    if "wrong_pixels" in case:
        return str(case["wrong_pixels"])
    check = deciding_check(case)
    return "" if check is None or case["verdict"] in (Outcome.PASS, Outcome.UNSUPPORTED) else wrong_of(check)


def wrong_of(check: Check) -> str:
    """Return how many pixels of a check are wrong, and by how much in the stage's unit; empty where none is."""
    if not _wrong(check) or check.examined is None:
        return ""
    things = "entries" if check.stage is Stage.CAMERA else "pixels"
    parts = [f"{_wrong(check):,} of {check.examined.pixels:,} {things} wrong at {check.stage}"]
    measured = [each for each in (check.end_to_end, check.continued) if each is not None]
    if check.stage not in COUNTED and (error := _mean_error(measured, _wrong(check))):
        unit = FACTS[check.stage].unit
        parts.append(f"by {error:.3g}{'' if unit in ('', '1') else f' {unit}'}{' on average' * (_wrong(check) > 1)}")
    strange = max((each.nan + (each.inf if check.stage is not Stage.DISTANCE else 0) for each in measured), default=0)
    if strange:
        parts.append(f"{strange:,} without a finite number")
    return ", ".join(parts)


def stated_reason(case: CaseRecord) -> str:
    """Return a case's reason as people read it; of one in which a reference is wrong, with whose pixels these are.

    A brief of a case, as lists have it, contains the sentence where it differs from the plain reason.
    """
    if "stated" in case:
        return str(case["stated"])
    reason, check = plain_reason(case.get("reason")), deciding_check(case)
    if check is None or (check.finding is None and check.outcome is not Outcome.REFERENCE_SUSPECT):
        return reason
    return f"Wrong are the pixels of {display_name(check.reference)}, not those of {check.configuration}: {reason}"


def _wrong(check: Check) -> int:
    return check.examined.wrong if check.examined else 0


def _mean_error(measured: list[Measurement], wrong: int) -> float:
    """Return the mean error of the wrong pixels, or the error of the only one; 0 where no number says it."""
    means = [each.mean_wrong for each in measured]
    if wrong == 1:
        means += [each.worst_error or 0.0 for each in measured]
    return next((mean for mean in map(float, means) if mean > 0 and math.isfinite(mean)), 0.0)
