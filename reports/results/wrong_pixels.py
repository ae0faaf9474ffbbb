"""Sentences with the number of a case's wrong pixels, their mean error, and the renderer that is wrong.

An error over its limit is infinite if the limit is 0, and no measure of the size of a mistake if the limit is tiny.
Reports therefore show the number of wrong pixels and their mean error in the stage's unit.
"""

import math
import re

from rayproof.cases.stages import FACTS, Stage
from rayproof.reports.results.case_records import CaseRecord, Check, Measurement
from rayproof.reports.results.outcomes import Outcome

DISPLAY_NAMES = {"radiance": "Radiance (rtrace)"}  # references whose name is also a word of the field
COUNTED = (Stage.OBJECT, Stage.VISIBILITY)  # stages whose errors have no size: another object, or another light
MOST_TIMES = 1000.0  # larger quotients of error and limit are not shown: they measure how small the limit is
_TIMES = re.compile(r" \((inf|nan|[-+.\de]+) times\)")
_AGAINST = re.compile(rf"\b(against|and) ({'|'.join(DISPLAY_NAMES)})\b(?=[,:; ]|$)")


def display_name(reference: str) -> str:
    """Return the name of a reference for display: `Radiance (rtrace)` for `radiance`."""
    return DISPLAY_NAMES.get(reference, reference)


def plain_reason(reason: object) -> str:
    """Return a check's or case's reason without quotients that are infinite or huge, with display names."""
    text = _TIMES.sub(lambda match: match[0] if float(match[1]) < MOST_TIMES else "", str(reason or ""))
    return _AGAINST.sub(lambda match: f"{match[1]} {display_name(match[2])}", text)


def deciding_check(case: CaseRecord) -> Check | None:
    """Return the check with the most wrong pixels among the checks with the case's verdict and stage, or None."""
    checks = [
        check
        for check in case.get("checks", [])
        if check.outcome == case["verdict"] and case.get("stage") in (None, check.stage)
    ]
    return max(checks, key=_wrong, default=None)


def wrong_pixels(case: CaseRecord) -> str:
    """Return a sentence with the number of wrong pixels at a case's stage and their mean error; empty if none is wrong.

    A case's entry in a list (its brief) contains the sentence already.
    """
    if "wrong_pixels" in case:
        return str(case["wrong_pixels"])
    check = deciding_check(case)
    return "" if check is None or case["verdict"] in (Outcome.PASS, Outcome.UNSUPPORTED) else wrong_of(check)


def wrong_of(check: Check) -> str:
    """Return a sentence with the number of a check's wrong pixels and their mean error; empty if none is wrong.

    The error is in the stage's unit.
    """
    if not _wrong(check) or check.examined is None:
        return ""
    things = "entries" if check.stage is Stage.CAMERA else "pixels"
    parts = [f"{_wrong(check):,} of {check.examined.pixels:,} {things} wrong at {check.stage}"]
    measured = [measurement for measurement in (check.end_to_end, check.continued) if measurement is not None]
    if check.stage not in COUNTED and (error := _mean_error(measured, _wrong(check))):
        unit = FACTS[check.stage].unit
        parts.append(f"by {error:.3g}{'' if unit in ('', '1') else f' {unit}'}{' on average' * (_wrong(check) > 1)}")
    strange = max(
        (measurement.nan + (measurement.inf if check.stage is not Stage.DISTANCE else 0) for measurement in measured),
        default=0,
    )
    if strange:
        parts.append(f"{strange:,} without a finite number")
    return ", ".join(parts)


def stated_reason(case: CaseRecord) -> str:
    """Return a case's reason for display; if a reference is wrong, with the name of that reference.

    A case's entry in a list (its brief) contains the sentence if it differs from the plain reason.
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
    """Return the mean error of the wrong pixels, or the error of the only wrong pixel; 0 if neither is finite."""
    means = [measurement.mean_wrong for measurement in measured]
    if wrong == 1:
        means += [measurement.worst_error or 0.0 for measurement in measured]
    return next((mean for mean in map(float, means) if mean > 0 and math.isfinite(mean)), 0.0)
