"""Adjudication: when candidate and reference differ, who is wrong? Never the tracer alone by default."""

from collections.abc import Mapping, Sequence

from cases.stages import Stage
from reports.judge.checks import Check
from reports.judge.outcomes import Outcome

ORACLE = "analytic"


def adjudicate(
    checks: Sequence[Check], panel: Mapping[tuple[str, Stage], Check], independent: Mapping[str, bool]
) -> None:
    """Turn a failure into `reference_suspect` where a third witness says that the reference is the one who is wrong.

    `panel` holds each other reference judged against the oracle: (reference, stage) -> check. Three rules, all with
    evidence in the reason. A reference that differs from the tracer is suspect if the tracer passes against the
    oracle and the reference does not. The oracle itself is suspect if it differs from the tracer, an independent
    reference agrees with the tracer at this or the next stage that it can judge, and differs from the oracle there.
    From that stage on no failure stands, against whomever: edges and limits are the suspect oracle's own.
    """
    verdicts = {(check.configuration, check.reference, check.stage): check for check in checks}
    failed = [check for check in checks if check.outcome is Outcome.FAIL]
    suspects: list[tuple[Check, str]] = []
    for check in failed:
        if check.reference == ORACLE:
            witness = _against_oracle(check, verdicts, panel, independent)
            if witness is not None:
                suspects.append((check, f"{witness} agrees with the tracer and differs from {ORACLE}"))
            continue
        mine = verdicts.get((check.configuration, ORACLE, check.stage))
        other = panel.get((check.reference, check.stage))
        if mine is not None and mine.outcome is Outcome.PASS and other is not None and other.ratio > 1:
            suspects.append((check, f"the tracer agrees with {ORACLE}, {check.reference} does not"))
    resting = _resting_on_the_oracle(failed, suspects)
    suspects += resting
    for check, _ in resting:
        check.suspected = ORACLE
    for check, evidence in suspects:
        check.outcome = Outcome.REFERENCE_SUSPECT
        check.reason = f"{check.reason}; {evidence}"


def _resting_on_the_oracle(failed: Sequence[Check], suspects: Sequence[tuple[Check, str]]) -> list[tuple[Check, str]]:
    """Return the failures at and after the first stage at which the oracle is suspect."""
    order = list(Stage)
    known = {id(check) for check, _ in suspects}
    found = []
    for configuration in {check.configuration for check in failed}:
        doubted = [c.stage for c, _ in suspects if c.configuration == configuration and c.reference == ORACLE]
        first = min(map(order.index, doubted), default=len(order))
        found += [
            (check, f"edges and limits are {ORACLE}'s, which is suspect from {order[first]} on")
            for check in failed
            if check.configuration == configuration and order.index(check.stage) >= first and id(check) not in known
        ]
    return found


def _against_oracle(
    check: Check,
    verdicts: Mapping[tuple[str, str, Stage], Check],
    panel: Mapping[tuple[str, Stage], Check],
    independent: Mapping[str, bool],
) -> str | None:
    """Return an independent reference that sides with the tracer against the oracle, or None."""
    stages = list(Stage)
    for reference, alone in independent.items():
        if not alone or reference == ORACLE:
            continue
        for stage in stages[stages.index(check.stage) :]:
            mine = verdicts.get((check.configuration, reference, stage))
            other = panel.get((reference, stage))
            if mine is None or other is None:
                continue
            if mine.outcome is Outcome.PASS and other.ratio > 1:
                return f"{reference} ({stage})"
            break
    return None
