"""Judging a case: every candidate before every witness at every stage, then blame, expectations and a verdict."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from cases.answers import Answers
from cases.case import Case
from cases.scene import Scene
from cases.stages import Stage
from reports.judge import blame
from reports.judge.adjudicate import ORACLE, adjudicate
from reports.judge.bench import Bench
from reports.judge.checks import Check, camera_check, stage_check
from reports.judge.conditioning import condition
from reports.judge.copies import copied
from reports.judge.expectations import judge as judge_expectation
from reports.judge.findings import explained
from reports.judge.limits import Roundoff
from reports.judge.measurement import jsonable
from reports.judge.outcomes import Outcome, worst
from reports.judge.parties import Candidate, Witness
from reports.judge.supersampled import box_mean, finer, supersampled_check


class FullOracle(Protocol):
    """What judging asks of the analytic reference."""

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> Answers:
        """Answer `stages`."""
        ...

    def at(self, scene: Scene, stages: Collection[Stage], points: np.ndarray) -> Answers:
        """Answer at image points (n, 2)."""
        ...

    def continue_from(self, scene: Scene, stage: Stage, given: Answers) -> np.ndarray:
        """Return the stage computed from the given previous ones."""
        ...

    def edges(self, scene: Scene) -> Any:
        """Return each pixel's distance to the nearest edges [px], as `reports.judge.classes.Edges`."""
        ...


@dataclass(kw_only=True)
class Judged:
    """A case's checks and what they add up to."""

    case: Case
    checks: list[Check]
    expectations: list[dict[str, Any]]
    outcome: Outcome
    stage: Stage | None
    item: str | None
    reason: str
    planned: int


def stages_of(scene: Scene) -> tuple[Stage, ...]:
    """Return the stages that a scene needs: without lights there is no light to ask about."""
    stages = tuple(Stage)
    return stages if scene.lights else stages[: stages.index(Stage.VISIBILITY)]


def judge_case(
    case: Case,
    candidates: Sequence[Candidate],
    witnesses: Sequence[Witness],
    oracle: FullOracle,
    versions: Mapping[str, str],
) -> Judged:
    """Judge every candidate against every witness, and settle who is wrong where they differ.

    Raises:
        LookupError: the analytic reference is not among the witnesses; without its edges nothing can be classed.

    """
    scene, stages = case.scene, stages_of(case.scene)
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
        checks = [_failed(c, w, s, Outcome.ERROR, f"{ORACLE}: {truth.error}") for c, w, s in planned]
        return _sum_up(case, checks, [], len(planned), None)
    whole = truth.answers if set(stages) <= set(truth.answers) else oracle.render(scene, stages)
    edges, factors = oracle.edges(scene), condition(scene, whole)
    misshapen = {candidate.name: _misshapen(scene, candidate) for candidate in candidates}
    candidates = [_without(candidate, misshapen[candidate.name]) for candidate in candidates]

    def bench(candidate: Candidate, witness: Witness) -> Bench:
        return Bench(
            scene=scene,
            truth=whole,
            edges=edges,
            conditioning=factors,
            oracle=oracle,
            candidate=candidate,
            witness=witness,
        )

    checks: list[Check] = []
    expectations: list[dict[str, Any]] = []
    sparse: list[str] = []
    for candidate in candidates:
        for witness in witnesses:
            mine = [stage for stage in stages if witness.answers_at(stage)]
            at = bench(candidate, witness)
            checks += _checks(at, mine, oracle if witness is truth else None, misshapen[candidate.name])
        if candidate.answers is not None:
            at_oracle = bench(candidate, truth)
            expectations += _expectations(case, candidate, at_oracle)
            sparse += _too_little(case, candidate, at_oracle)
    if case.samples > 1 and scene.lights:
        means, asked = _means(case, candidates, witnesses, oracle)
        checks += means
        planned += asked
    panel = _panel(witnesses, truth, stages, bench)
    adjudicate(checks, panel, {witness.name: witness.independent for witness in witnesses})
    for check in checks:
        known = explained(check.reference, versions.get(check.reference, ""), check.stage, case.name)
        if check.outcome is Outcome.REFERENCE_SUSPECT and known is not None:
            check.outcome, check.reason = Outcome.WARN, f"{check.reason}; known: {known.what}"
    judged = _sum_up(case, checks, expectations, len(planned), {c.name: c for c in candidates})
    if sparse:
        judged.outcome = worst([judged.outcome, Outcome.ERROR])
        judged.reason = judged.reason or sparse[0]
    return judged


def _failed(candidate: Candidate, witness: Witness, stage: Stage, outcome: Outcome, reason: str) -> Check:
    check = Check(configuration=candidate.name, reference=witness.name, stage=stage, outcome=outcome, reason=reason)
    check.ratio = float("inf") if outcome is Outcome.FAIL else 0.0
    return check


def _misshapen(scene: Scene, candidate: Candidate) -> dict[Stage, str]:
    """Return a reason for each image stage of another size than the camera's; nothing is ever broadcast."""
    size = (scene.camera.height, scene.camera.width)
    return {
        stage: f"{stage} has shape {np.shape(image)}, not {size} and channels"
        for stage, image in (candidate.answers or {}).items()
        if stage is not Stage.CAMERA and (np.ndim(image) != 3 or np.shape(image)[:2] != size)
    }


def _without(candidate: Candidate, stages: Collection[Stage]) -> Candidate:
    """Return the candidate without the answers of some stages."""
    if candidate.answers is None or not stages:
        return candidate
    return replace(
        candidate, answers={stage: image for stage, image in candidate.answers.items() if stage not in stages}
    )


def _checks(
    bench: Bench, stages: Sequence[Stage], oracle: FullOracle | None, misshapen: Mapping[Stage, str]
) -> list[Check]:
    """Return a check for each planned stage of one candidate before one witness; none is left out."""
    candidate, witness = bench.candidate, bench.witness
    checks: list[Check] = []
    if candidate.answers is not None and copied(candidate.answers, witness.answers):
        why = f"{witness.name} repeats {candidate.name} to the last bit: it is no witness"
        return [_failed(candidate, witness, stage, Outcome.REFERENCE_SUSPECT, why) for stage in stages]
    for stage in stages:
        if candidate.answers is None:
            checks.append(_failed(candidate, witness, stage, Outcome.ERROR, f"{candidate.name}: {candidate.error}"))
        elif witness.error is not None:
            checks.append(_failed(candidate, witness, stage, Outcome.ERROR, f"{witness.name}: {witness.error}"))
        elif stage in misshapen:
            checks.append(_failed(candidate, witness, stage, Outcome.FAIL, misshapen[stage]))
        elif stage not in candidate.answers:
            checks.append(_failed(candidate, witness, stage, Outcome.UNSUPPORTED, f"{candidate.name} gave no {stage}"))
        elif stage not in witness.answers:
            checks.append(_failed(candidate, witness, stage, Outcome.MISSING, f"{witness.name} gave no {stage}"))
        elif stage is Stage.CAMERA:
            checks.append(camera_check(bench))
        else:
            checks.append(stage_check(bench, stage, oracle))
    return checks


def _panel(witnesses: Sequence[Witness], truth: Witness, stages: Sequence[Stage], bench) -> dict:
    """Return each other reference judged against the oracle, stage by stage."""
    panel: dict[tuple[str, Stage], Check] = {}
    for witness in witnesses:
        if witness is truth or witness.error is not None:
            continue
        as_candidate = Candidate(
            name=witness.name,
            precision=witness.precision,
            items=frozenset(),
            shadow_epsilon=witness.shadow_epsilon,
            answers=witness.answers,
        )
        at = bench(as_candidate, truth)
        for stage in stages:
            if stage in witness.answers and stage is not Stage.CAMERA:
                panel[witness.name, stage] = stage_check(at, stage, None)
    return panel


def _means(
    case: Case, candidates: Sequence[Candidate], witnesses: Sequence[Witness], oracle: FullOracle
) -> tuple[list[Check], list[tuple[Candidate, Witness, Stage]]]:
    """Judge box-filtered radiance, every candidate before every witness that renders it; return checks and plan."""
    scene = finer(case.scene, case.samples)
    planned = [(c, w, Stage.RADIANCE) for c in candidates for w in witnesses if w.answers_at(Stage.RADIANCE)]
    truth = oracle.render(scene, stages_of(scene))
    edges, factors = oracle.edges(scene), condition(scene, truth)
    checks = []
    for candidate, witness, stage in planned:
        if candidate.fine is None or witness.mean is None:
            why = candidate.error or witness.error or "no box-filtered image was given"
            checks.append(_failed(candidate, witness, stage, Outcome.ERROR, why))
            continue
        fine = Bench(
            scene=scene,
            truth=truth,
            edges=edges,
            conditioning=factors,
            oracle=oracle,
            candidate=replace(
                candidate,
                answers=candidate.fine,
                shadow_epsilon=_finer(candidate.shadow_epsilon, case.samples),
            ),
            witness=replace(witness, shadow_epsilon=_finer(witness.shadow_epsilon, case.samples)),
        )
        ours = box_mean(candidate.fine[Stage.RADIANCE], case.samples)
        checks.append(supersampled_check(fine, ours, witness.mean, case.samples))
    return checks, planned


def _finer(epsilon: float | np.ndarray, samples: int) -> float | np.ndarray:
    """Return an epsilon at the resolution of the samples: a pixel's holds for all of its samples."""
    return np.kron(epsilon, np.ones((samples, samples))) if np.ndim(epsilon) else epsilon


def _expectations(case: Case, candidate: Candidate, bench: Bench) -> list[dict[str, Any]]:
    """Judge the case's closed forms on one candidate's answers."""
    assert candidate.answers is not None
    found = []
    for expectation in case.expectations:
        stage = getattr(expectation, "stage", Stage.VISIBILITY if hasattr(expectation, "form") else Stage.IRRADIANCE)
        finding = judge_expectation(expectation, case.scene, candidate.answers, _slack(bench, stage))
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


def _slack(bench: Bench, stage: Stage) -> float:
    """Return the candidate's own rounding relative to the image's typical value: the median of limit over value."""
    if stage is Stage.VISIBILITY:
        return Roundoff(bench.candidate.precision)(64)
    value, limit = np.abs(bench.truth[stage]).max(axis=-1), bench.limits.end_to_end[stage]
    limit = limit.max(axis=-1) if limit.ndim == 3 else limit
    good = bench.conditioning.hit & (value > 0) & np.isfinite(value)
    return float(np.median(limit[good] / value[good])) if np.any(good) else 0.0


def _too_little(case: Case, candidate: Candidate, bench: Bench) -> list[str]:
    """Return a sentence if fewer pixels could be judged than the case fixed in advance, else nothing."""
    last = Stage.RADIANCE if case.scene.lights else Stage.NORMAL
    edge = bench.classes.edge(last)
    interior = int(np.count_nonzero(bench.conditioning.hit & ~edge))
    share = np.count_nonzero(edge) / edge.size
    if interior < case.least_interior:
        return [f"{candidate.name}: {interior} interior pixels, the case asks for {case.least_interior}"]
    if share > case.most_edge:
        return [f"{candidate.name}: {share:.4f} of the pixels are edge, the case allows {case.most_edge}"]
    return []


def _sum_up(
    case: Case,
    checks: list[Check],
    expectations: list[dict[str, Any]],
    planned: int,
    candidates: Mapping[str, Candidate] | None,
) -> Judged:
    """Return the case's verdict: the worst of its checks and expectations, and the first stage to blame."""
    outcome = worst([check.outcome for check in checks] + [Outcome(one["verdict"]) for one in expectations])
    guilty = [check for check in checks if check.outcome is outcome and outcome is not Outcome.PASS]
    order = list(Stage)
    # A stage that is wrong by itself comes before one that only shows what it was handed.
    guilty.sort(key=lambda check: (not check.alone, order.index(check.stage), -check.ratio))
    judged = Judged(
        case=case,
        checks=checks,
        expectations=expectations,
        outcome=outcome,
        stage=None,
        item=None,
        reason="",
        planned=planned,
    )
    if guilty:
        check = guilty[0]
        judged.stage = check.stage
        judged.reason = f"{check.configuration} against {check.reference}, {check.stage}: {check.reason}"
        if candidates is not None and outcome is Outcome.FAIL:
            judged.item = _item(case, check, candidates[check.configuration.split(" x")[0]])
    elif outcome is not Outcome.PASS:
        broken = next(one for one in expectations if one["verdict"] == outcome.value)
        judged.stage = Stage(broken["stage"])
        judged.reason = (
            f"{broken['configuration']}: {broken['measured']} instead of {broken['expected']}: {broken['because']}"
        )
    return judged


def _item(case: Case, check: Check, candidate: Candidate) -> str:
    """Return the specification item behind a failed check."""
    ours = theirs = -1
    measured = check.continued if check.alone else check.end_to_end
    if measured is not None and measured.pixel is not None and candidate.answers is not None:
        column, row = measured.pixel
        ours = int(candidate.answers[Stage.OBJECT][row, column, 0])
        theirs = int(measured.theirs[0]) if check.stage is Stage.OBJECT else ours
    if not -1 <= ours < len(case.scene.shapes):
        ours = -1
    return blame.item(
        check.stage, case.scene, candidate.items, ours=ours, theirs=theirs, alone=check.alone, part=check.part
    )
