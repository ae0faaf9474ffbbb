"""`judge_case`: all subjects, references and stages of a case, then adjudication and verdict."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from msgspec import structs

from rayproof.cases.case import Case
from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Answers, lost, well_shaped, without
from rayproof.reports.judge.answers import misshapen as misshapen_answers
from rayproof.reports.judge.box_filter import mean_checks
from rayproof.reports.judge.checks import pair_checks, unmeasured
from rayproof.reports.judge.closed_forms import closed_forms
from rayproof.reports.judge.comparison import Comparison
from rayproof.reports.judge.conventions import Tested, in_words, tested
from rayproof.reports.judge.copied_answers import with_equal_answers_shared
from rayproof.reports.judge.declared_epsilons import (
    Excess,
    excess,
    held_to_epsilons,
    mostly_edges,
    only_at_edges,
    with_enough_to_tell,
    with_too_little_seen,
)
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
from rayproof.reports.judge.scene_truth import SceneTruth, scene_truth
from rayproof.reports.judge.stage_measuring import inside
from rayproof.reports.judge.verdict import Judged, sum_up
from rayproof.reports.results.case_records import AdjudicationRecord, Check, ExpectationRecord
from rayproof.reports.results.outcomes import Outcome


def judge_case(
    case: Case,
    subjects: Sequence[Answers],
    references: Sequence[Answers],
    oracle: FullOracle,
    versions: Mapping[str, str],
    *,
    panel: Sequence[str] = (),
) -> Judged:
    """Judge every subject against every reference, and decide which one is wrong where they differ.

    `panel` names the references that were announced: one of whom nothing came, not even an error, is missing.

    Raises:
        LookupError: the analytic reference is not among the references; without its edges nothing can be classed.

    """
    scene, stages = case.scene, stages_of(case.scene)
    references = [*references, *lost(panel, references)]
    truth = next((reference for reference in references if reference.name == ORACLE), None)
    if truth is None:
        raise LookupError(f"{ORACLE} must be among the references; it says which pixels are edges")
    planned = [
        (subject, reference, stage)
        for subject in subjects
        for reference in references
        for stage in stages
        if reference.answers_at(stage)
    ]
    if truth.error is not None:
        checks = [unmeasured(c, w, s, Outcome.ERROR, f"{ORACLE}: {truth.error}") for c, w, s in planned]
        return sum_up(case, checks, [], len(planned), None, {})
    base = scene_truth(scene, stages, oracle, known=truth.answers)
    misshapen = {renderer.name: misshapen_answers(scene, renderer.answers) for renderer in (*subjects, *references)}
    subjects = with_equal_answers_shared([without(one, misshapen[one.name]) for one in subjects])
    references = [without(one, misshapen[one.name]) for one in references]

    measured = _Measured()
    for subject in subjects:
        _measure(measured, case, subject, references, truth, base, misshapen)
    if case.samples > 1 and scene.lights:
        means, asked = mean_checks(case, subjects, references, oracle)
        measured.checks.extend(means)
        planned += asked
    each = matrices(base, subjects, references, stages, measured.checks)
    checks = _settled(case, measured, subjects, references, each, base, versions)
    judged = sum_up(case, checks, measured.expectations, len(planned), {c.name: c for c in subjects}, each)
    judged = replace(judged, base=base)
    return judged.worsened(Outcome.ERROR, measured.too_little[0]) if measured.too_little else judged


@dataclass(frozen=True)
class _Measured:
    """What was found of the subjects before anybody is blamed."""

    checks: list[Check] = field(default_factory=list)
    expectations: list[ExpectationRecord] = field(default_factory=list)
    too_little: list[str] = field(default_factory=list)  # why there is too little of an image to judge a subject by
    mostly_edges: set[str] = field(default_factory=set)  # subjects of whose pixels too many are edges
    beyond: dict[str, Excess] = field(default_factory=dict)  # by subject


def _measure(
    measured: _Measured,
    case: Case,
    subject: Answers,
    references: Sequence[Answers],
    truth: Answers,
    base: SceneTruth,
    misshapen: Mapping[str, Mapping[Stage, str]],
) -> None:
    """Add what is found of a subject before every reference, and before the closed forms."""
    found: list[Check] = []
    for reference in references:
        mine = [stage for stage in stages_of(case.scene) if reference.answers_at(stage)]
        pair = Comparison(base=base, subject=subject, reference=reference)
        found += [
            check if check.end_to_end is None else with_enough_to_tell(case, check, pair)
            for check in pair_checks(pair, mine, misshapen)
        ]
    if subject.error is None:
        at_oracle = Comparison(base=base, subject=subject, reference=truth)
        measured.beyond[subject.name] = excess(at_oracle)
        measured.expectations.extend(closed_forms(case, subject, at_oracle))
        found, why = with_too_little_seen(case, found, at_oracle)
        measured.too_little.extend(why)
        if mostly_edges(case, at_oracle):
            measured.mostly_edges.add(subject.name)
    measured.checks.extend(found)


def _settled(
    case: Case,
    measured: _Measured,
    subjects: Sequence[Answers],
    references: Sequence[Answers],
    each: Mapping[Stage, Matrix],
    base: SceneTruth,
    versions: Mapping[str, str],
) -> list[Check]:
    """Return the checks, each with the side that is wrong by the panel, the known defects and what edges can tell."""
    tested = {subject.name for subject in subjects}
    independent = {reference.name: reference.independent for reference in references}
    contradictions = Contradictions(
        base=base,
        subjects={subject.name: subject for subject in subjects},
        references={reference.name: reference for reference in references},
        checks=measured.checks,
    )
    checks = adjudicated(measured.checks, each, independent, lambda name: voice(name, tested), contradictions.sides)
    renderers = {renderer.name: renderer for renderer in (*subjects, *references)}
    checks = [_with_known_defect(check, renderers, versions, base) for check in checks]

    def only_edges(check: Check) -> bool:
        subject, reference = renderers[check.configuration], renderers[check.reference]
        return only_at_edges(check, checks, Comparison(base=base, subject=subject, reference=reference))

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
    check: Check, renderers: Mapping[str, Answers], versions: Mapping[str, str], base: SceneTruth
) -> Check:
    """Return the check; where a checked-in finding explains all of its failing pixels it is a warning."""
    guilty = {Outcome.REFERENCE_SUSPECT: check.reference, Outcome.FAIL: check.configuration}.get(check.outcome)
    if guilty is None or check.stage is Stage.CAMERA:
        return check
    pixels = _failing(check, renderers, base)
    known = explained(guilty, versions.get(guilty, ""), check.stage, base.scene, base.truth, pixels)
    if known is None:
        return check
    return structs.replace(
        check, outcome=Outcome.WARN, reason=f"{check.reason}; known: {known.what}", finding=known.name
    )


def _undecided_at_edges(case: Case, check: Check) -> Check:
    """Return the check; what it was to fail by could be told of no pixel, where too many are edges."""
    reason = f"{check.reason}; only at edges, and too many pixels are edges to tell their sides"
    return structs.replace(check, outcome=Outcome.ERROR if case.tuned else Outcome.UNDECIDED, reason=reason)


def _failing(check: Check, renderers: Mapping[str, Answers], base: SceneTruth) -> np.ndarray:
    """Return the pixels (height, width) that a check fails by: over the limit away from edges, and the worst of all.

    Of box-filtered means, whose pixels are others, every pixel that hits something.
    """
    subject, reference = renderers.get(check.configuration), renderers.get(check.reference)
    if subject is None or reference is None or check.end_to_end is None:
        return base.conditioning.hit
    found = inside(Comparison(base=base, subject=subject, reference=reference), check.stage) > 1
    for one in (check.end_to_end, check.continued):
        if one is not None and one.pixel is not None and not one.worst_ratio <= 1:
            column, row = one.pixel
            found[row, column] = True
    return found


# What a case's record says of the panel: each stage's matrix, who stands alone, and which convention explains it.


def adjudication(
    judged: Judged, subjects: Sequence[Answers], references: Sequence[Answers], oracle: FullOracle
) -> dict[str, AdjudicationRecord]:
    """Return {stage: matrix, baseline of interior and limits, who stands alone, why} as docs/results.md describes it.

    Conventions are put to the test for each voice that stands alone, at the first image stage at which it does: what
    follows from there follows from that.
    """
    names = {subject.name for subject in subjects}
    renderers = {subject.name: subject for subject in subjects}
    renderers |= {reference.name: reference for reference in references}
    renderers = {name: well_shaped(judged.case.scene, renderer) for name, renderer in renderers.items()}
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
            results = tested(judged.case.scene, renderers[who], stage, oracle)
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
