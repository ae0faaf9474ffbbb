"""A subject that supports some stages only is judged on these: what it says it cannot is no pass and no failure.

Checks of such stages stay `unsupported`; a case in which nothing else was measured is `unsupported` as well.
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from rayproof.reports.judge.renderers import Candidate
from rayproof.reports.judge.verdict.case_verdict import case_outcome
from rayproof.reports.results.outcomes import Outcome

if TYPE_CHECKING:
    from rayproof.reports.judge.verdict.case_verdict import Judged

MEASURED = (Outcome.PASS, Outcome.WARN)


def count_what_is_supported(judged: "Judged", candidates: Sequence[Candidate]) -> None:
    """Set the case's outcome by what was measured, if nothing is amiss but stages that a candidate declared."""
    if judged.outcome is not Outcome.UNSUPPORTED:
        return
    declared = {(candidate.name, stage) for candidate in candidates for stage in candidate.unsupported}
    left = [one for one in judged.checks if (one.configuration, one.stage) not in declared]
    lost = next((one for one in left if one.outcome is Outcome.UNSUPPORTED), None)
    if lost is not None:  # a stage that was neither given nor declared
        why = f"{lost.configuration} against {lost.reference}, {lost.stage}: {lost.reason}"
        judged.outcome, judged.stage, judged.item, judged.reason = Outcome.MISSING, lost.stage, None, why
    elif left or judged.expectations:
        outcome = case_outcome(left, judged.expectations)
        why = next((one.reason for one in left if one.outcome is outcome), "")
        judged.outcome, judged.stage, judged.item, judged.reason = outcome, None, None, why


def concerning(outcomes: Iterable[Outcome], *, tracer: bool) -> list[Outcome]:
    """Return the cases' outcomes that a run's verdict goes by: not those that a subject cannot do, if it can others."""
    found = list(outcomes)
    supported = [outcome for outcome in found if outcome is not Outcome.UNSUPPORTED]
    return found if tracer or not any(outcome in MEASURED for outcome in supported) else supported
