"""A subject that supports some stages only is judged on these: what it says it cannot is no pass and no failure.

Checks of such stages stay `unsupported`; a case in which nothing else was measured is `unsupported` as well.
"""

from collections.abc import Sequence
from dataclasses import replace

from rayproof.reports.judge.renderers import Candidate
from rayproof.reports.judge.verdict.case_verdict import Judged, case_outcome
from rayproof.reports.results.outcomes import Outcome


def of_what_is_supported(judged: Judged, candidates: Sequence[Candidate]) -> Judged:
    """Return the verdict by what was measured, if nothing is amiss but stages that a candidate declared."""
    if judged.outcome is not Outcome.UNSUPPORTED:
        return judged
    declared = {(candidate.name, stage) for candidate in candidates for stage in candidate.unsupported}
    left = [one for one in judged.checks if (one.configuration, one.stage) not in declared]
    lost = next((one for one in left if one.outcome is Outcome.UNSUPPORTED), None)
    if lost is not None:  # a stage that was neither given nor declared
        why = f"{lost.configuration} against {lost.reference}, {lost.stage}: {lost.reason}"
        return replace(judged, outcome=Outcome.MISSING, stage=lost.stage, item=None, reason=why)
    if left or judged.expectations:
        outcome = case_outcome(left, judged.expectations)
        why = next((one.reason for one in left if one.outcome is outcome), "")
        return replace(judged, outcome=outcome, stage=None, item=None, reason=why)
    return judged
