"""Adjudication: when candidate and reference differ, who is wrong? Never the one under test alone by default."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.check import Check
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.judge.panel.code_families import SUBJECT
from rayproof.reports.judge.panel.matrix import Matrix
from rayproof.reports.results.outcomes import Outcome


def adjudicated(
    checks: Sequence[Check],
    panel: Mapping[Stage, Matrix],
    independent: Mapping[str, bool],
    voice: Callable[[str], str],
    contradicted: Callable[[Check], Mapping[str, str]] = lambda _: {},
) -> list[Check]:
    """Return the checks; a failure is `reference_suspect` where the panel says that the reference is wrong.

    Every independent voice that can compare both takes a side, at the failure's stage or the next one that it can
    judge: it sides with the one under test if that passes against it while it differs from the reference, and with
    the reference the other way round. More voices for the one under test than for the reference make the reference
    suspect, the oracle like any other; a split panel leaves the failure standing. Of a failure that is one only where
    continued from the oracle `contradicted` says who sides with whom (`contradictions.py`). Where the oracle is suspect
    no failure from that stage on stands, against whomever: edges and limits are the suspect oracle's own.
    """
    verdicts = {(check.configuration, check.reference, check.stage): check for check in checks}
    witnesses = [name for name, alone in independent.items() if alone]

    def heard(check: Check) -> Check:
        if check.outcome is not Outcome.FAIL:
            return check
        with_it, against_it = _sides(check, witnesses, verdicts, panel, voice)
        for name, side in contradicted(check).items():
            if voice(name) not in (voice(check.reference), SUBJECT):
                (with_it if side == "with" else against_it)[name] = check.stage.value
        mine, theirs = ({voice(name) for name in side} for side in (with_it, against_it))
        outcome, told = check.outcome, check.reason
        if len(mine) > len(theirs):
            words = ", ".join(f"{name} ({stage})" for name, stage in with_it.items())
            outcome = Outcome.REFERENCE_SUSPECT
            told += f"; {words} agrees with {check.configuration} and differs from {check.reference}"
        elif mine:
            both = [", ".join(side) for side in (with_it, against_it)]
            told += f"; the panel is split: {both[0]} with {check.configuration}, {both[1]} with {check.reference}"
        return replace(check, outcome=outcome, reason=told, evidence={"with": with_it, "against": against_it})

    return _not_resting_on_a_suspect([heard(check) for check in checks])


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


def _not_resting_on_a_suspect(checks: Sequence[Check]) -> list[Check]:
    """Return the checks; no failure stands at and after the first stage at which the oracle is suspect."""
    order = list(Stage)
    doubted: dict[str, int] = {}  # configuration -> the first stage at which the oracle is suspect
    for check in checks:
        if check.outcome is Outcome.REFERENCE_SUSPECT and check.reference == ORACLE and check.evidence:
            place = order.index(check.stage)
            doubted[check.configuration] = min(place, doubted.get(check.configuration, place))

    def rests(check: Check) -> bool:
        first = doubted.get(check.configuration)
        return check.outcome is Outcome.FAIL and first is not None and order.index(check.stage) >= first

    return [
        replace(
            check,
            outcome=Outcome.REFERENCE_SUSPECT,
            reason=f"{check.reason}; edges and limits are {ORACLE}'s, which is suspect from "
            f"{order[doubted[check.configuration]]} on",
            suspected=ORACLE,
        )
        if rests(check)
        else check
        for check in checks
    ]
