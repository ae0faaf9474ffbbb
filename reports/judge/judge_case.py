"""Judging a case: every candidate before every witness at every stage, then who is wrong, then a verdict."""

from collections.abc import Mapping, Sequence

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.box_filtered_checks import mean_checks
from rayproof.reports.judge.comparison.check import Check, camera_check, stage_check, unmeasured
from rayproof.reports.judge.comparison.closed_forms import closed_forms
from rayproof.reports.judge.comparison.copied_answers import copied
from rayproof.reports.judge.comparison.decidable import crowded, leave_undecided, only_at_edges, too_little_seen
from rayproof.reports.judge.comparison.declared_epsilons import Excess, excess, hold_epsilons
from rayproof.reports.judge.comparison.equal_answers import shared
from rayproof.reports.judge.comparison.image_shapes import misshapen as misshapen_answers
from rayproof.reports.judge.comparison.image_shapes import without
from rayproof.reports.judge.comparison.pair import Bench
from rayproof.reports.judge.oracle import FullOracle, stages_of
from rayproof.reports.judge.panel.adjudicate import ORACLE, adjudicate
from rayproof.reports.judge.panel.code_families import voice
from rayproof.reports.judge.panel.contradictions import Contradictions
from rayproof.reports.judge.panel.known_defects import explained
from rayproof.reports.judge.panel.matrix import matrices
from rayproof.reports.judge.renderers import Candidate, Witness, abstention, lost
from rayproof.reports.judge.tolerance.output_resolution import Coarseness
from rayproof.reports.judge.tolerance.pair_limits import Terms
from rayproof.reports.judge.tolerance.scene_context import Ground, ground
from rayproof.reports.judge.verdict.case_verdict import Judged, sum_up
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import ExpectationRecord


def judge_case(
    case: Case,
    candidates: Sequence[Candidate],
    witnesses: Sequence[Witness],
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
        return sum_up(case, checks, [], len(planned), None)
    base = ground(scene, stages, oracle, known=truth.answers)
    misshapen = {party.name: misshapen_answers(scene, party.answers) for party in (*candidates, *witnesses)}
    candidates = shared([without(candidate, misshapen[candidate.name]) for candidate in candidates])
    witnesses = [without(witness, misshapen[witness.name]) for witness in witnesses]

    checks: list[Check] = []
    expectations: list[ExpectationRecord] = []
    sparse: list[str] = []
    crowds: set[str] = set()
    beyond: dict[str, Excess] = {}
    for candidate in candidates:
        for witness in witnesses:
            mine = [stage for stage in stages if witness.answers_at(stage)]
            at = Bench(ground=base, candidate=candidate, witness=witness)
            found = _checks(at, mine, oracle if witness.name == ORACLE else None, misshapen)
            for check in found:
                if check.end_to_end is not None:
                    leave_undecided(case, check, at.terms)
            checks += found
        if candidate.answers is not None:
            at_oracle = Terms(ground=base, candidate=candidate, witness=truth)
            beyond[candidate.name] = excess(at_oracle)
            expectations += closed_forms(case, candidate, at_oracle)
            sparse += too_little_seen(case, checks, at_oracle)
            if crowded(case, at_oracle):
                crowds.add(candidate.name)
    if case.samples > 1 and scene.lights:
        means, asked = mean_checks(case, candidates, witnesses, oracle)
        checks += means
        planned += asked
    each = matrices(base, candidates, witnesses, stages, checks)
    tested = {candidate.name for candidate in candidates}
    independent = {witness.name: witness.independent for witness in witnesses}
    asked = Contradictions(
        ground=base,
        candidates={candidate.name: candidate for candidate in candidates},
        witnesses={witness.name: witness for witness in witnesses},
        checks=checks,
    )
    adjudicate(checks, each, independent, lambda name: voice(name, tested), asked.sides)
    parties = {party.name: party for party in (*candidates, *witnesses)}
    for check in checks:
        guilty = {Outcome.REFERENCE_SUSPECT: check.reference, Outcome.FAIL: check.configuration}.get(check.outcome)
        known = None
        if guilty and check.stage is not Stage.CAMERA:
            pixels = _failing(check, parties, base)
            known = explained(guilty, versions.get(guilty, ""), check.stage, scene, base.truth, pixels)
        if known is not None:
            check.outcome, check.reason = Outcome.WARN, f"{check.reason}; known: {known.what}"
            check.known = known.name
        failed = check.outcome in (Outcome.FAIL, Outcome.REFERENCE_SUSPECT)
        if failed and check.configuration in crowds and only_at_edges(check, checks):
            check.outcome = Outcome.ERROR if case.tuned else Outcome.UNDECIDED
            check.reason = f"{check.reason}; only at edges, and too many pixels are edges to tell their sides"
    hold_epsilons(checks, beyond, case.most_edge)
    judged = sum_up(case, checks, expectations, len(planned), {c.name: c for c in candidates})
    judged.panel = each
    if sparse:
        judged.worsen(Outcome.ERROR, sparse[0])
    return judged


def _failing(check: Check, parties: Mapping[str, Candidate | Witness], base: Ground) -> np.ndarray:
    """Return the pixels (height, width) that a check fails by: over the limit away from edges, and the worst of all.

    Of box-filtered means, whose pixels are others, every pixel that hits something.
    """
    candidate, witness = parties.get(check.configuration), parties.get(check.reference)
    if not isinstance(candidate, Candidate) or not isinstance(witness, Witness) or check.end_to_end is None:
        return base.conditioning.hit
    found = Bench(ground=base, candidate=candidate, witness=witness).inside(check.stage) > 1
    for one in (check.end_to_end, check.continued):
        if one is not None and one.pixel is not None and not one.worst_ratio <= 1:
            column, row = one.pixel
            found[row - base.scene.camera.first_row, column] = True
    return found


def _checks(
    bench: Bench, stages: Sequence[Stage], oracle: FullOracle | None, misshapen: Mapping[str, Mapping[Stage, str]]
) -> list[Check]:
    """Return a check for each planned stage of one candidate before one witness; none is left out."""
    candidate, witness = bench.candidate, bench.witness
    checks: list[Check] = []
    coarse = Coarseness(resolutions=candidate.resolutions)
    single = candidate.precision == witness.precision == "float32"
    ours = candidate.answers or {}
    same = copied(ours, witness.answers, bench.ground.truth, both_float32=single)
    why = f"{witness.name} repeats {candidate.name} to the last bit: it is no witness"
    for stage in stages:
        if candidate.answers is None:
            checks.append(unmeasured(candidate, witness, stage, Outcome.ERROR, f"{candidate.name}: {candidate.error}"))
        elif stage in candidate.lacking:
            why_not = f"{candidate.name}: {candidate.lacking[stage]}"
            checks.append(unmeasured(candidate, witness, stage, Outcome.MISSING, why_not))
        elif stage in candidate.unsupported:
            why_not = f"{candidate.name} cannot: {candidate.unsupported[stage]}"
            checks.append(unmeasured(candidate, witness, stage, Outcome.UNSUPPORTED, why_not))
        elif stage in same:
            checks.append(unmeasured(candidate, witness, stage, Outcome.REFERENCE_SUSPECT, why))
        elif witness.error is not None:
            why_not = f"{witness.name} abstains: {witness.error}"
            checks.append(unmeasured(candidate, witness, stage, abstention(witness), why_not))
            checks[-1].abstains = True
        elif stage in misshapen[candidate.name]:
            checks.append(unmeasured(candidate, witness, stage, Outcome.FAIL, misshapen[candidate.name][stage]))
        elif stage not in candidate.answers:
            checks.append(
                unmeasured(candidate, witness, stage, Outcome.UNSUPPORTED, f"{candidate.name} gave no {stage}")
            )
        elif stage in misshapen[witness.name]:
            why_not = f"{witness.name}'s {misshapen[witness.name][stage]}: it is no witness"
            checks.append(unmeasured(candidate, witness, stage, Outcome.REFERENCE_SUSPECT, why_not))
        elif stage not in witness.answers:
            checks.append(unmeasured(candidate, witness, stage, Outcome.MISSING, f"{witness.name} gave no {stage}"))
        elif stage is Stage.CAMERA:
            checks.append(camera_check(bench))
        elif (why_not := coarse.too_coarse(stage, bench.ground.truth[stage])) is not None:
            checks.append(unmeasured(candidate, witness, stage, Outcome.UNSUPPORTED, f"{candidate.name}: {why_not}"))
        else:
            checks.append(stage_check(bench, stage, oracle))
    return checks
