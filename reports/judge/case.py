"""Judging a case: every candidate before every witness at every stage, then who is wrong, then a verdict."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.stages import Stage
from rayproof.reports.judge.admissible import (
    Excess,
    excess,
    held_to_epsilons,
    mostly_edges,
    only_at_edges,
    with_enough_to_tell,
    with_too_little_seen,
)
from rayproof.reports.judge.answers import Answers, lost, well_shaped, without
from rayproof.reports.judge.answers import misshapen as misshapen_answers
from rayproof.reports.judge.box_filter import mean_checks
from rayproof.reports.judge.checks import Check, pair_checks, unmeasured
from rayproof.reports.judge.closed_forms import closed_forms
from rayproof.reports.judge.comparison import Bench
from rayproof.reports.judge.conventions import Tested, in_words, tested
from rayproof.reports.judge.copied_answers import with_equal_answers_shared
from rayproof.reports.judge.known_defects import explained
from rayproof.reports.judge.oracle import ORACLE, FullOracle, stages_of
from rayproof.reports.judge.panel import (
    Contradictions,
    Matrix,
    Standing,
    adjudicated,
    matrices,
    standing,
    voice,
)
from rayproof.reports.judge.scene_truth import Ground, Terms, ground
from rayproof.reports.judge.verdict import Judged, sum_up
from rayproof.reports.results.case_records import AdjudicationRecord, ExpectationRecord
from rayproof.reports.results.outcomes import Outcome


def judge_case(
    case: Case,
    candidates: Sequence[Answers],
    witnesses: Sequence[Answers],
    oracle: FullOracle,
    versions: Mapping[str, str],
    *,
    panel: Sequence[str] = (),
) -> Judged:
    """Judge every candidate against every witness, and settle who is wrong where they differ.

    `panel` names the references that were announced: one of whom nothing came, not even an error, is missing.

    Raises:
        LookupError: the analytic reference is not among the witnesses; without its edges nothing can be classed.

    """
    scene, stages = case.scene, stages_of(case.scene)
    witnesses = [*witnesses, *lost(panel, witnesses)]
    truth = next((witness for witness in witnesses if witness.name == ORACLE), None)
    if truth is None:
        raise LookupError(f"{ORACLE} must be among the references; it says which pixels are edges")
    planned = [
        (candidate, witness, stage)
        for candidate in candidates
        for witness in witnesses
        for stage in stages
        if witness.answers_at(stage)
    ]
    if truth.error is not None:
        checks = [unmeasured(c, w, s, Outcome.ERROR, f"{ORACLE}: {truth.error}") for c, w, s in planned]
        return sum_up(case, checks, [], len(planned), None, {})
    base = ground(scene, stages, oracle, known=truth.answers)
    misshapen = {party.name: misshapen_answers(scene, party.answers) for party in (*candidates, *witnesses)}
    candidates = with_equal_answers_shared([without(one, misshapen[one.name]) for one in candidates])
    witnesses = [without(one, misshapen[one.name]) for one in witnesses]

    measured = _Measured()
    for candidate in candidates:
        _measure(measured, case, candidate, witnesses, truth, base, misshapen)
    if case.samples > 1 and scene.lights:
        means, asked = mean_checks(case, candidates, witnesses, oracle)
        measured.checks.extend(means)
        planned += asked
    each = matrices(base, candidates, witnesses, stages, measured.checks)
    checks = _settled(case, measured, candidates, witnesses, each, base, versions)
    judged = sum_up(case, checks, measured.expectations, len(planned), {c.name: c for c in candidates}, each)
    judged = replace(judged, ground=base)
    return judged.worsened(Outcome.ERROR, measured.too_little[0]) if measured.too_little else judged


@dataclass(frozen=True)
class _Measured:
    """What was found of the candidates before anybody is blamed."""

    checks: list[Check] = field(default_factory=list)
    expectations: list[ExpectationRecord] = field(default_factory=list)
    too_little: list[str] = field(default_factory=list)  # why there is too little of an image to judge a candidate by
    mostly_edges: set[str] = field(default_factory=set)  # candidates of whose pixels too many are edges
    beyond: dict[str, Excess] = field(default_factory=dict)  # by candidate


def _measure(
    measured: _Measured,
    case: Case,
    candidate: Answers,
    witnesses: Sequence[Answers],
    truth: Answers,
    base: Ground,
    misshapen: Mapping[str, Mapping[Stage, str]],
) -> None:
    """Add what is found of a candidate before every witness, and before the closed forms."""
    found: list[Check] = []
    for witness in witnesses:
        mine = [stage for stage in stages_of(case.scene) if witness.answers_at(stage)]
        at = Bench(ground=base, candidate=candidate, witness=witness)
        pair = pair_checks(at, mine, misshapen)
        found += [one if one.end_to_end is None else with_enough_to_tell(case, one, at.terms) for one in pair]
    if candidate.error is None:
        at_oracle = Terms(ground=base, candidate=candidate, witness=truth)
        measured.beyond[candidate.name] = excess(at_oracle)
        measured.expectations.extend(closed_forms(case, candidate, at_oracle))
        found, why = with_too_little_seen(case, found, at_oracle)
        measured.too_little.extend(why)
        if mostly_edges(case, at_oracle):
            measured.mostly_edges.add(candidate.name)
    measured.checks.extend(found)


def _settled(
    case: Case,
    measured: _Measured,
    candidates: Sequence[Answers],
    witnesses: Sequence[Answers],
    each: Mapping[Stage, Matrix],
    base: Ground,
    versions: Mapping[str, str],
) -> list[Check]:
    """Return the checks, each with the side that is wrong by the panel, the known defects and what edges can tell."""
    tested = {candidate.name for candidate in candidates}
    independent = {witness.name: witness.independent for witness in witnesses}
    contradictions = Contradictions(
        ground=base,
        candidates={candidate.name: candidate for candidate in candidates},
        witnesses={witness.name: witness for witness in witnesses},
        checks=measured.checks,
    )
    checks = adjudicated(measured.checks, each, independent, lambda name: voice(name, tested), contradictions.sides)
    parties = {party.name: party for party in (*candidates, *witnesses)}
    checks = [_with_known_defect(check, parties, versions, base) for check in checks]

    def only_edges(check: Check) -> bool:
        candidate, witness = parties[check.configuration], parties[check.reference]
        assert candidate is not None
        assert witness is not None
        return only_at_edges(check, checks, Terms(ground=base, candidate=candidate, witness=witness))

    checks = [
        _undecided_at_edges(case, check)
        if check.outcome in (Outcome.FAIL, Outcome.REFERENCE_SUSPECT)
        and check.configuration in measured.mostly_edges
        and only_edges(check)
        else check
        for check in checks
    ]
    return held_to_epsilons(checks, measured.beyond, case.most_edge)


def _with_known_defect(
    check: Check, parties: Mapping[str, Answers], versions: Mapping[str, str], base: Ground
) -> Check:
    """Return the check; where a checked-in finding explains all of its failing pixels it is a warning."""
    guilty = {Outcome.REFERENCE_SUSPECT: check.reference, Outcome.FAIL: check.configuration}.get(check.outcome)
    if guilty is None or check.stage is Stage.CAMERA:
        return check
    pixels = _failing(check, parties, base)
    known = explained(guilty, versions.get(guilty, ""), check.stage, base.scene, base.truth, pixels)
    if known is None:
        return check
    return replace(check, outcome=Outcome.WARN, reason=f"{check.reason}; known: {known.what}", known=known.name)


def _undecided_at_edges(case: Case, check: Check) -> Check:
    """Return the check; what it was to fail by could be told of no pixel, where too many are edges."""
    reason = f"{check.reason}; only at edges, and too many pixels are edges to tell their sides"
    return replace(check, outcome=Outcome.ERROR if case.tuned else Outcome.UNDECIDED, reason=reason)


def _failing(check: Check, parties: Mapping[str, Answers], base: Ground) -> np.ndarray:
    """Return the pixels (height, width) that a check fails by: over the limit away from edges, and the worst of all.

    Of box-filtered means, whose pixels are others, every pixel that hits something.
    """
    candidate, witness = parties.get(check.configuration), parties.get(check.reference)
    if candidate is None or witness is None or check.end_to_end is None:
        return base.conditioning.hit
    found = Bench(ground=base, candidate=candidate, witness=witness).inside(check.stage) > 1
    for one in (check.end_to_end, check.continued):
        if one is not None and one.pixel is not None and not one.worst_ratio <= 1:
            column, row = one.pixel
            found[row, column] = True
    return found


# What a case's record says of the panel: each stage's matrix, who stands alone, and which convention explains it.


def adjudication(
    judged: Judged, candidates: Sequence[Answers], witnesses: Sequence[Answers], oracle: FullOracle
) -> dict[str, AdjudicationRecord]:
    """Return {stage: matrix, baseline of interior and limits, who stands alone, why} as docs/results.md describes it.

    Conventions are put to the test for each voice that stands alone, at the first image stage at which it does: what
    follows from there follows from that.
    """
    names = {candidate.name for candidate in candidates}
    parties = {candidate.name: candidate for candidate in candidates}
    parties |= {witness.name: witness for witness in witnesses}
    parties = {name: well_shaped(judged.case.scene, party) for name, party in parties.items()}
    record: dict[str, AdjudicationRecord] = {}
    first: dict[str, Stage] = {}
    for stage, matrix in judged.panel.items():
        one = standing(matrix, lambda name: voice(name, names))
        results: list[Tested] = []
        words = ""
        who = _whose(one)
        if who in first:
            words = f" It is off from {first[who]} on."
        elif who is not None and stage is not Stage.CAMERA:
            first[who] = stage
            results = tested(judged.case.scene, parties[who], stage, oracle)
            words = in_words(results)
        record[stage.value] = {
            "baseline": ORACLE,
            **matrix.as_json(),
            "alone": ", ".join(one.alone) or None,
            "why": one.why + words,
        }
        if results:
            record[stage.value]["conventions"] = [result.as_json() for result in results]
    return record


def _whose(one: Standing) -> str | None:
    """Return whose answers to hold against conventions: who stands alone, or whom the oracle stands against."""
    if not one.alone:
        return None
    return one.alone[0] if one.alone[0] != ORACLE else one.majority[0]
