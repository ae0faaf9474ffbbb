"""Adjudication: when candidate and reference differ, who is wrong? Never the one under test alone by default."""

from collections.abc import Callable, Mapping, Sequence

from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.check import Check
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.judge.panel.code_families import SUBJECT
from rayproof.reports.judge.panel.matrix import Matrix
from rayproof.reports.results.outcomes import Outcome


def adjudicate(
    checks: Sequence[Check],
    panel: Mapping[Stage, Matrix],
    independent: Mapping[str, bool],
    voice: Callable[[str], str],
    contradicted: Callable[[Check], Mapping[str, str]] = lambda _: {},
) -> None:
    """Turn a failure into `reference_suspect` where the panel's other voices say that the reference is the wrong one.

    Every independent voice that can compare both takes a side, at the failure's stage or the next one that it can
    judge: it sides with the one under test if that passes against it while it differs from the reference, and with
    the reference the other way round. More voices for the one under test than for the reference make the reference
    suspect, the oracle like any other; a split panel leaves the failure standing. Of a failure that is one only where
    continued from the oracle `contradicted` says who sides with whom (`contradictions.py`). Where the oracle is suspect
    no failure from that stage on stands, against whomever: edges and limits are the suspect oracle's own.
    """
    verdicts = {(check.configuration, check.reference, check.stage): check for check in checks}
    failed = [check for check in checks if check.outcome is Outcome.FAIL]
    suspects: list[tuple[Check, str]] = []
    for check in failed:
        witnesses = [name for name, alone in independent.items() if alone]
        with_it, against_it = _sides(check, witnesses, verdicts, panel, voice)
        for name, side in contradicted(check).items():
            if voice(name) not in (voice(check.reference), SUBJECT):
                (with_it if side == "with" else against_it)[name] = check.stage.value
        check.evidence = {"with": with_it, "against": against_it}
        mine, theirs = ({voice(name) for name in side} for side in (with_it, against_it))
        if len(mine) > len(theirs):
            words = ", ".join(f"{name} ({stage})" for name, stage in with_it.items())
            suspects.append((check, f"{words} agrees with {check.configuration} and differs from {check.reference}"))
        elif mine:
            both = [", ".join(side) for side in (with_it, against_it)]
            check.reason += (
                f"; the panel is split: {both[0]} with {check.configuration}, {both[1]} with {check.reference}"
            )
    resting = _resting_on_the_oracle(failed, suspects)
    suspects += resting
    for check, _ in resting:
        check.suspected = ORACLE
    for check, evidence in suspects:
        check.outcome = Outcome.REFERENCE_SUSPECT
        check.reason = f"{check.reason}; {evidence}"


def _sides(
    check: Check,
    witnesses: Sequence[str],
    verdicts: Mapping[tuple[str, str, Stage], Check],
    panel: Mapping[Stage, Matrix],
    voice: Callable[[str], str],
) -> tuple[dict[str, str], dict[str, str]]:
    """Return the witnesses that side with the one under test and those that side with its reference, with the stage."""
    stages = list(Stage)
    mine: dict[str, str] = {}
    theirs: dict[str, str] = {}
    for name in witnesses:
        if voice(name) in (voice(check.reference), SUBJECT):
            continue
        for stage in stages[stages.index(check.stage) :]:
            own = verdicts.get((check.configuration, name, stage))
            agree = panel[stage].agree(name, check.reference) if stage in panel else None
            if own is None or agree is None or (own.end_to_end is None and stage is not Stage.CAMERA):
                continue
            if own.outcome is Outcome.PASS and not agree:
                mine[name] = stage.value
            elif own.outcome is Outcome.FAIL and agree:
                theirs[name] = stage.value
            break
    return mine, theirs


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
