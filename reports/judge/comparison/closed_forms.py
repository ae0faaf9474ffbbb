"""A case's closed forms, judged on one candidate's answers with the candidate's own rounding allowed for."""

from typing import Any

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.expectations import judge
from rayproof.reports.judge.comparison.measurement import jsonable
from rayproof.reports.judge.renderers import Candidate
from rayproof.reports.judge.tolerance.channels import largest
from rayproof.reports.judge.tolerance.limits import Roundoff
from rayproof.reports.judge.tolerance.pair_limits import Terms
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import ExpectationRecord


def closed_forms(case: Case, candidate: Candidate, terms: Terms) -> list[ExpectationRecord]:
    """Judge the case's closed forms on one candidate's answers."""
    assert candidate.answers is not None
    found = []
    for expectation in case.expectations:
        stage = getattr(expectation, "stage", Stage.VISIBILITY if hasattr(expectation, "form") else Stage.IRRADIANCE)
        if not _needed(expectation, stage) <= set(candidate.answers):
            continue  # not every renderer answers every stage
        finding = judge(expectation, case.scene, candidate.answers, _slack(terms, stage))
        outcome = Outcome.MISSING if not finding.used else Outcome.PASS if finding.ratio <= 1 else Outcome.FAIL
        found.append(
            {
                "configuration": candidate.name,
                "kind": type(expectation).__name__,
                "stage": stage.value,
                "verdict": outcome.value,
                "measured": jsonable(finding.measured),
                "expected": jsonable(finding.expected),
                "limit": jsonable(finding.limit),
                "ratio": jsonable(finding.ratio),
                "used": finding.used,
                "because": expectation.because,
            }
        )
    return found


def _needed(expectation: Any, stage: Stage) -> set[Stage]:
    """Return the stages that a closed form is read off: pixels are found by their object, an outline by positions."""
    needed = {stage}
    if hasattr(expectation, "shape"):
        needed.add(Stage.OBJECT)
    if hasattr(expectation, "form"):
        needed.add(Stage.POSITION)
    return needed


def _slack(terms: Terms, stage: Stage) -> float:
    """Return the candidate's own rounding relative to the image's typical value: the median of limit over value."""
    if stage is Stage.VISIBILITY:
        return Roundoff(terms.candidate.precision)(64)
    value, limit = largest(np.abs(terms.truth[stage])), terms.limits.end_to_end[stage]
    limit = largest(limit) if limit.ndim == 3 else limit
    good = terms.conditioning.hit & (value > 0) & np.isfinite(value)
    return float(np.median(limit[good] / value[good])) if np.any(good) else 0.0
