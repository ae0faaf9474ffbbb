"""`judge_case`: the checks of all subjects, references and stages of a case, adjudication and verdict."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from msgspec import structs

from rayproof.cases.case import ITEMS_OF_OTHERS, Case
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers, lost, without
from rayproof.reports.judge.answers import misshapen as misshapen_answers
from rayproof.reports.judge.box_filter import mean_checks
from rayproof.reports.judge.checks import pair_checks, unmeasured
from rayproof.reports.judge.closed_forms import closed_forms
from rayproof.reports.judge.conventions import Tested, in_words, tested
from rayproof.reports.judge.known_defects import explained
from rayproof.reports.judge.oracle import ORACLE, stages_of
from rayproof.reports.judge.pairs import RendererPair
from rayproof.reports.judge.panel import (
    AgreementMatrix,
    Contradictions,
    PanelConclusion,
    adjudicated,
    matrices,
    standing,
    voice,
)
from rayproof.reports.judge.promises import held_to_epsilons, held_to_promise
from rayproof.reports.judge.scene_truth import SceneTruth, scene_truth
from rayproof.reports.judge.verdict import Judged, sum_up
from rayproof.reports.results.case_records import AdjudicationRecord, Check, ExpectationRecord
from rayproof.reports.results.outcomes import Outcome


def judge_case(
    case: Case,
    subjects: Sequence[Answers],
    references: Sequence[Answers],
    oracle: Analytic,
    versions: Mapping[str, str],
    *,
    panel: Sequence[str] = (),
) -> Judged:
    """Judge every subject against every reference, and decide which of them is wrong if they differ.

    `panel` has the names of the planned references: a reference without a reply, not even an error, is missing.

    Raises:
        LookupError: the analytic reference is not among the references; without its answers nothing can be judged.

    """
    scene, stages = case.scene, stages_of(case.scene)
    references = [*references, *lost(panel, references)]
    truth = next((reference for reference in references if reference.name == ORACLE), None)
    if truth is None:
        raise LookupError(f"{ORACLE} must be among the references; every renderer is judged against it")
    planned = [
        (subject, reference, stage)
        for subject in subjects
        for reference in references
        for stage in stages
        if reference.answers_at(stage)
    ]
    if truth.error is not None:
        checks = [
            unmeasured(subject, reference, stage, Outcome.ERROR, f"{ORACLE}: {truth.error}")
            for subject, reference, stage in planned
        ]
        return sum_up(case, checks, [], len(planned), None, {})
    base = scene_truth(scene, stages, oracle, known=truth.answers)
    misshapen = {renderer.name: misshapen_answers(scene, renderer.answers) for renderer in (*subjects, *references)}
    against = {
        renderer.name: AgainstOracle(base, without(renderer, misshapen[renderer.name]))
        for renderer in (*subjects, *references)
    }
    tested = [against[subject.name] for subject in subjects]
    panelists = [against[reference.name] for reference in references]

    measured: list[Check] = []  # before any renderer is blamed
    expectations: list[ExpectationRecord] = []
    for subject in tested:
        measured += _checks(case, subject, panelists, misshapen)
        if subject.renderer.error is None:
            expectations += closed_forms(case, subject)
    if case.samples > 1 and scene.lights:
        means, planned_means = mean_checks(
            case, [compared.renderer for compared in tested], [compared.renderer for compared in panelists], oracle
        )
        measured += means
        planned += planned_means
    stage_matrices = matrices([*tested, *panelists], stages, measured)
    checks = _settled(case, measured, tested, panelists, stage_matrices, versions)
    judged = sum_up(case, checks, expectations, len(planned), {c.name: c for c in subjects}, stage_matrices)
    return replace(judged, base=base, against=against)


def _checks(
    case: Case,
    subject: AgainstOracle,
    references: Sequence[AgainstOracle],
    misshapen: Mapping[str, Mapping[Stage, str]],
) -> list[Check]:
    """Return a subject's checks against every reference."""
    checks: list[Check] = []
    for reference in references:
        stages = [stage for stage in stages_of(case.scene) if reference.renderer.answers_at(stage)]
        checks += pair_checks(RendererPair(subject, reference), stages, misshapen)
    return checks


def _settled(
    case: Case,
    measured: list[Check],
    subjects: Sequence[AgainstOracle],
    references: Sequence[AgainstOracle],
    panel_matrices: Mapping[Stage, AgreementMatrix],
    versions: Mapping[str, str],
) -> list[Check]:
    """Return the checks after adjudication by the panel, the known defects and the case's promise."""
    names = {subject.renderer.name for subject in subjects}
    independent = {reference.renderer.name: reference.renderer.independent for reference in references}
    renderers = {against.renderer.name: against for against in (*subjects, *references)}
    contradictions = Contradictions(renderers=renderers, references=tuple(independent), checks=measured)
    checks = adjudicated(measured, panel_matrices, independent, lambda name: voice(name, names), contradictions.sides)
    checks = [_with_known_defect(check, renderers, versions) for check in checks]
    checks = held_to_epsilons(checks, renderers, case.most_explained)
    own = {subject.renderer.name for subject in subjects if subject.renderer.items != ITEMS_OF_OTHERS}
    base = references[0].base
    return [held_to_promise(case, check, base, own=check.configuration in own and case.tuned) for check in checks]


def _with_known_defect(check: Check, renderers: Mapping[str, AgainstOracle], versions: Mapping[str, str]) -> Check:
    """Return the check, changed to a warning if a recorded finding explains all of its failing pixels."""
    suspect = {Outcome.REFERENCE_SUSPECT: check.reference, Outcome.FAIL: check.configuration}.get(check.outcome)
    if suspect is None or check.stage is Stage.CAMERA:
        return check
    base = next(iter(renderers.values())).base
    pixels = _failing(check, renderers, base)
    defect = explained(suspect, versions.get(suspect, ""), check.stage, base.scene, base.truth, pixels)
    if defect is None:
        return check
    return structs.replace(
        check, outcome=Outcome.WARN, reason=f"{check.reason}; known: {defect.what}", finding=defect.name
    )


def _failing(check: Check, renderers: Mapping[str, AgainstOracle], base: SceneTruth) -> np.ndarray:
    """Return the failing pixels (height, width) of a check.

    For box-filtered means, which are compared elsewhere, these are all pixels with a hit.
    """
    subject, reference = renderers.get(check.configuration), renderers.get(check.reference)
    if subject is None or reference is None or check.end_to_end is None:
        return base.conditioning.hit
    failing = RendererPair(subject, reference).pixels(check.stage).wrong
    continued = subject.continued(check.stage) if check.continued is not None else None
    return failing if continued is None else failing | continued.wrong


# The panel in a case's record: each stage's matrix, its outlier, and the convention that explains it.


def adjudication(judged: Judged, subjects: Sequence[Answers], oracle: Analytic) -> dict[str, AdjudicationRecord]:
    """Return {stage: matrix, baseline of interior and limits, outlier, reason} as docs/results.md describes it.

    Conventions are tested for each outlier, at its first image stage: its later differences follow from that.
    """
    names = {subject.name for subject in subjects}
    record: dict[str, AdjudicationRecord] = {}
    first: dict[str, Stage] = {}
    for stage, matrix in judged.panel.items():
        conclusion = standing(matrix, lambda name: voice(name, names))
        results: list[Tested] = []
        words = ""
        outlier = _whose(conclusion)
        if outlier in first:
            words = f" It is off from {first[outlier]} on."
        elif outlier is not None and stage is not Stage.CAMERA:
            first[outlier] = stage
            results = tested(judged.case.scene, judged.against[outlier], stage, oracle)
            words = in_words(results)
        record[stage.value] = {
            "baseline": ORACLE,
            **matrix.as_json(),
            "alone": ", ".join(conclusion.alone) or None,
            "why": conclusion.why + words,
        }
        if results:
            record[stage.value]["conventions"] = [result.as_json() for result in results]
    return record


def _whose(conclusion: PanelConclusion) -> str | None:
    """Return the renderer to compare with conventions: the outlier, or one in the majority if that is the oracle."""
    if not conclusion.alone:
        return None
    return conclusion.alone[0] if conclusion.alone[0] != ORACLE else conclusion.majority[0]
