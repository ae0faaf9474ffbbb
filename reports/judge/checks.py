"""Checks: one subject, one reference, one stage, judged end to end and continued from the subject's own stages."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import structs

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, upto
from rayproof.reports.judge import camera_check
from rayproof.reports.judge.answers import Answers, abstention
from rayproof.reports.judge.forward.common_factors import Factors
from rayproof.reports.judge.comparison import LIGHT, Comparison
from rayproof.reports.judge.copied_answers import copied
from rayproof.reports.judge.forward.limits import BECAUSE, Coarseness, Roundoff, calibration
from rayproof.reports.judge.measurement import (
    Kind,
    cells_of,
    counted,
    most_interval,
    unexamined,
)
from rayproof.reports.judge.metrics import METRICS
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.judge.stage_measuring import measure_continued, measure_end_to_end, shared_factors
from rayproof.reports.results.case_records import Check, Measurement
from rayproof.reports.results.outcomes import Outcome

# The stage whose images people look at: its informative metrics, before the oracle, are worth their time.
INFORMED = Stage.RADIANCE


def check_camera(pair: Comparison) -> Check:
    """Judge the camera stage; where the two differ, invariants of every camera tell which one is wrong."""
    mine = pair.subject.answers[Stage.CAMERA] if pair.subject.answers else {}
    theirs = pair.reference.answers[Stage.CAMERA]
    # The coarser of the two arithmetics: the other's rounding is nothing beside it, or equal and within the counts.
    g = max(Roundoff(pair.subject.precision), Roundoff(pair.reference.precision), key=lambda each: each(1))
    found = pair.base.once(
        ("camera", g, *pair.authors(Stage.CAMERA)),
        lambda: camera_check.compared(mine, theirs, pair.base.scene.camera, g),
    )
    outcome, reason = Outcome.PASS, ""
    if not found.ratio <= 1:
        outcome = Outcome.FAIL
        reason = f"{found.part} is off by {found.error:.3g}, limit {found.limit:.3g} ({found.ratio:.3g} times)"
        ours_bad = camera_check.inconsistency(mine, pair.base.scene.camera, g)
        theirs_bad = camera_check.inconsistency(theirs, pair.base.scene.camera, g)
        if ours_bad <= 1 < theirs_bad:
            outcome = Outcome.REFERENCE_SUSPECT
            reason += f"; {pair.subject.name}'s camera is consistent in itself, {pair.reference.name}'s is not"
    return Check(
        configuration=pair.subject.name,
        reference=pair.reference.name,
        stage=Stage.CAMERA,
        outcome=outcome,
        reason=reason,
        because=_because(pair.reference.name, Stage.CAMERA),
        ratio=found.ratio,
        examined=found.examined,
    )


def stage_check(pair: Comparison, stage: Stage) -> Check:
    """Judge one image stage end to end and, before the oracle, continued from the subject's own stages."""
    ours = pair.subject.answers
    end_to_end, continued, shared, shared_continued = measure_end_to_end(pair, stage), None, None, None
    by_oracle = pair.reference.name == ORACLE
    if by_oracle and set(upto(stage)[:-1]) <= {Stage.CAMERA, *ours}:
        continued = measure_continued(pair, stage)
        if stage in LIGHT:
            shared_continued = shared_factors(pair, stage, continued=True)
    if by_oracle and stage in LIGHT:
        shared = shared_factors(pair, stage, continued=False)
    if stage is INFORMED and (by_oracle or pair.subject.name == ORACLE):
        both = ours[stage], pair.reference.answers[stage]
        informative = pair.base.once(("informative", *pair.authors(stage)), lambda: _inform(*both))
        end_to_end = structs.replace(end_to_end, **informative)
    outcome, ratio, reason = _conclusion(
        pair.reference.name, stage, end_to_end, continued, shared=shared, shared_continued=shared_continued
    )
    kinds = _together(end_to_end, continued)
    examined = counted(kinds)
    return Check(
        configuration=pair.subject.name,
        reference=pair.reference.name,
        stage=stage,
        outcome=outcome,
        reason=reason,
        ratio=ratio,
        end_to_end=end_to_end,
        continued=continued,
        bias=None if shared is None else shared.recorded(shared_continued),
        because=_because(pair.reference.name, stage) + pair.because(stage),
        examined=examined,
        cells=cells_of(kinds == Kind.WRONG) if examined.wrong else None,
    )


def _because(reference: str, stage: Stage) -> str:
    """Return from what the usual limit of a stage before a reference is derived."""
    return f"{BECAUSE[stage]}; {reference}: {calibration(reference).origin}"


def _together(whole: Measurement, continued: Measurement | None) -> np.ndarray:
    """Return each pixel's kind end to end, wrong also where it is only given the subject's previous stages."""
    if continued is None:
        return whole.kinds
    wrong = continued.kinds == Kind.WRONG
    return np.where(wrong, continued.kinds, whole.kinds) if wrong.any() else whole.kinds


def _conclusion(
    reference: str,
    stage: Stage,
    whole: Measurement,
    continued: Measurement | None,
    *,
    shared: Factors | None,
    shared_continued: Factors | None,
) -> tuple[Outcome, float, str]:
    """Return what the measurements of a stage come to: the outcome, the worst error over its limit, and why.

    `shared` and `shared_continued` are the factors that many pixels share, each of them within its own limit.
    """
    worst = whole if continued is None else max(whole, continued, key=lambda one: one.worst_ratio)
    if whole.nan or whole.inf:
        why = f"{whole.nan} pixels are NaN and {whole.inf} infinite where {reference} is finite"
        return Outcome.FAIL, worst.worst_ratio, why
    if not worst.worst_ratio <= 1:
        how = "given its own previous stages" if worst is continued else "end to end"
        why = (
            f"{how} pixel {worst.pixel} is off by {worst.worst_error:.3g}, limit {worst.limit:.3g} "
            f"({worst.worst_ratio:.3g} times)"
        )
        return Outcome.FAIL, worst.worst_ratio, why
    for factors, how in ((shared_continued, "given its own previous stages "), (shared, "")):
        if factors is not None and not factors.ratio <= 1 and factors.worst is not None:
            return Outcome.FAIL, factors.ratio, how + factors.worst.sentence(stage, reference)
    return Outcome.PASS, worst.worst_ratio, ""


def _inform(ours: np.ndarray, theirs: np.ndarray) -> dict[str, Any]:
    """Return the informative metrics with the range that they are relative to; they never decide."""
    if not (np.isfinite(ours).all() and np.isfinite(theirs).all()):
        return {}
    value_range = (float(min(ours.min(), theirs.min())), float(max(ours.max(), theirs.max())))
    # None of them depends on the unit. By a power of two, which rounds nothing, so that squares stay in range.
    unit = int(np.frexp(max(map(abs, value_range)))[1])
    ours, theirs = np.ldexp(ours, -unit), np.ldexp(theirs, -unit)
    scaled = (float(np.ldexp(value_range[0], -unit)), float(np.ldexp(value_range[1], -unit)))
    return {name: METRICS[name](ours, theirs, scaled) for name in METRICS} | {"range": value_range}


def accounted(checks: Sequence[Check], scene: Scene, *, tuned: bool) -> list[Check]:
    """Return the checks, each with its ledger; one with pixels that were not examined, or are wrong, is no pass.

    Too many intervals are an error of a case that was `tuned` to have fewer; any other they leave undecided.
    """
    return [_accounted(check, scene, tuned=tuned) for check in checks]


def _accounted(check: Check, scene: Scene, *, tuned: bool) -> Check:
    left = unexamined(check.stage, scene.camera) if check.examined is None else check.examined
    found, most = structs.replace(check, examined=left), most_interval(left.pixels)
    # A warning for a declared epsilon says that all others hold; one for a finding says that they do not.
    if check.outcome is not Outcome.PASS and (check.outcome is not Outcome.WARN or check.finding):
        return found
    if left.unexamined or left.wrong:
        why = f"{left.unexamined + left.wrong} of {left.pixels} pixels were held to nothing"
        return structs.replace(found, outcome=Outcome.ERROR, reason=why)
    if left.interval > most:
        why = (
            f"{left.interval} of {left.pixels} pixels are held to an interval only, which says too little of more "
            f"than {most}"
        )
        return structs.replace(found, outcome=Outcome.ERROR if tuned else Outcome.UNDECIDED, reason=why)
    return found


def unmeasured(
    subject: Answers,
    reference: Answers,
    stage: Stage,
    outcome: Outcome,
    reason: str,
    *,
    abstains: bool = False,
    stopped: bool = False,
) -> Check:
    """Return a check that ended before anything was measured."""
    return Check(
        configuration=subject.name,
        reference=reference.name,
        stage=stage,
        outcome=outcome,
        reason=reason,
        ratio=float("inf") if outcome is Outcome.FAIL else 0.0,
        because=_because(reference.name, stage),
        abstains=abstains,
        stopped=stopped,
    )


# A check for every planned stage of one subject before one reference; none is left out, whatever is in its way.


def pair_checks(pair: Comparison, stages: Sequence[Stage], misshapen: Mapping[str, Mapping[Stage, str]]) -> list[Check]:
    """Return a check for each of the stages.

    `misshapen` says by renderer and stage whose images have another size than was asked for.
    """
    repeated = _repeated(pair)
    checks = []
    for stage in stages:
        # Of several obstacles the first in this order counts.
        checks.append(
            _declined(pair, stage)
            or repeated.get(stage)
            or _abstained(pair, stage)
            or _not_answered(pair, stage, misshapen[pair.subject.name])
            or _not_answered_by_reference(pair, stage, misshapen[pair.reference.name])
            or _too_coarse(pair, stage)
            or (check_camera(pair) if stage is Stage.CAMERA else stage_check(pair, stage))
        )
    return checks


def _declined(pair: Comparison, stage: Stage) -> Check | None:
    """Return what the subject itself gave as the reason of not answering."""
    subject, about = pair.subject, (pair.subject, pair.reference, stage)
    if subject.error is not None:
        return unmeasured(*about, Outcome.ERROR, f"{subject.name}: {subject.error}", stopped=subject.stopped)
    if stage in subject.lacking:
        return unmeasured(*about, Outcome.MISSING, f"{subject.name}: {subject.lacking[stage]}")
    if stage in subject.unsupported:
        return unmeasured(*about, Outcome.UNSUPPORTED, f"{subject.name} cannot: {subject.unsupported[stage]}")
    return None


def _repeated(pair: Comparison) -> dict[Stage, Check]:
    """Return the stages in which the reference has the subject's own numbers."""
    subject, reference = pair.subject, pair.reference
    single = subject.precision == reference.precision == "float32"
    stages = copied(subject.answers, reference.answers, pair.base.truth, both_float32=single)
    reason = f"{reference.name} repeats {subject.name} to the last bit: it is no witness"
    return {stage: unmeasured(subject, reference, stage, Outcome.REFERENCE_SUSPECT, reason) for stage in stages}


def _abstained(pair: Comparison, stage: Stage) -> Check | None:
    subject, reference = pair.subject, pair.reference
    if reference.error is None:
        return None
    why = "was stopped by its time limit" if reference.stopped else "abstains"
    reason = f"{reference.name} {why}: {reference.error}"
    outcome = abstention(reference)
    return unmeasured(subject, reference, stage, outcome, reason, abstains=True, stopped=reference.stopped)


def _not_answered(pair: Comparison, stage: Stage, misshapen: Mapping[Stage, str]) -> Check | None:
    about = pair.subject, pair.reference, stage
    if stage in misshapen:
        return unmeasured(*about, Outcome.FAIL, misshapen[stage])
    if stage not in pair.subject.answers:
        return unmeasured(*about, Outcome.UNSUPPORTED, f"{pair.subject.name} gave no {stage}")
    return None


def _not_answered_by_reference(pair: Comparison, stage: Stage, misshapen: Mapping[Stage, str]) -> Check | None:
    about, name = (pair.subject, pair.reference, stage), pair.reference.name
    if stage in misshapen:
        return unmeasured(*about, Outcome.REFERENCE_SUSPECT, f"{name}'s {misshapen[stage]}: it is no witness")
    if stage not in pair.reference.answers:
        return unmeasured(*about, Outcome.MISSING, f"{name} gave no {stage}")
    return None


def _too_coarse(pair: Comparison, stage: Stage) -> Check | None:
    """Return that the subject's output keeps too little of a stage to tell anything."""
    if stage is Stage.CAMERA:
        return None
    subject = pair.subject
    why = Coarseness(resolutions=subject.resolutions).too_coarse(stage, pair.base.truth[stage])
    reason = f"{subject.name}: {why}"
    return None if why is None else unmeasured(subject, pair.reference, stage, Outcome.UNSUPPORTED, reason)
