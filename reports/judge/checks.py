"""Checks: one subject, one reference, one stage, judged end to end and continued from the subject's own stages."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import structs

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge import camera_check
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers, abstention
from rayproof.reports.judge.copies import copied
from rayproof.reports.judge.forward.common_factors import CHANNELS, Factors
from rayproof.reports.judge.forward.limits import BECAUSE, Roundoff, calibration
from rayproof.reports.judge.measurement import Kind, StagePixels, cells_of, counted, measure, unexamined
from rayproof.reports.judge.metrics import METRICS
from rayproof.reports.judge.nearby.clouds import LIGHT
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.judge.pairs import RendererPair
from rayproof.reports.results.case_records import Check, Measurement
from rayproof.reports.results.outcomes import Outcome

# The stage whose images are published: its informative metrics against the oracle are worth their computing time.
INFORMED = Stage.RADIANCE


def check_camera(pair: RendererPair) -> Check:
    """Judge the camera stage; if the two differ, invariants of every camera decide which one is wrong."""
    subject_camera = pair.subject.answers[Stage.CAMERA] if pair.subject.answers else {}
    reference_camera = pair.reference.answers[Stage.CAMERA]
    # The roundoff of the coarser precision: the other's is negligible, or equal and covered by the counts.
    g = max(Roundoff(pair.subject.precision), Roundoff(pair.reference.precision), key=lambda roundoff: roundoff(1))
    camera = pair.base.scene.camera
    compared = camera_check.compared(subject_camera, reference_camera, camera, g)
    outcome, reason = Outcome.PASS, ""
    if not compared.ratio <= 1:
        outcome = Outcome.FAIL
        reason = (
            f"{compared.part} is off by {compared.error:.3g}, limit {compared.limit:.3g} ({compared.ratio:.3g} times)"
        )
        subject_ratio = camera_check.inconsistency(subject_camera, camera, g)
        reference_ratio = camera_check.inconsistency(reference_camera, camera, g)
        if subject_ratio <= 1 < reference_ratio:
            outcome = Outcome.REFERENCE_SUSPECT
            reason += f"; {pair.subject.name}'s camera is consistent in itself, {pair.reference.name}'s is not"
    return Check(
        configuration=pair.subject.name,
        reference=pair.reference.name,
        stage=Stage.CAMERA,
        outcome=outcome,
        reason=reason,
        because=_because(pair.reference.name, Stage.CAMERA),
        ratio=compared.ratio,
        examined=compared.examined,
    )


def stage_check(pair: RendererPair, stage: Stage) -> Check:
    """Judge one image stage end to end and, against the oracle, continued from the subject's own stages."""
    whole = pair.pixels(stage)
    end_to_end, continued, shared, shared_continued = measured(pair.one, whole), None, None, None
    kinds = whole.kinds
    if pair.by_oracle:
        from_oracle = pair.one.continued(stage)
        if from_oracle is not None:
            continued = measured(pair.one, from_oracle)
            kinds = np.where(from_oracle.wrong, from_oracle.kinds, kinds) if from_oracle.wrong.any() else kinds
        if stage in LIGHT:
            factors = pair.one.common_factors
            shared = factors.of(stage)
            shared_continued = None if from_oracle is None else factors.of(stage, from_oracle)
    if stage is INFORMED and (pair.by_oracle or pair.subject.name == ORACLE):
        informative = _inform(pair.subject.answers[stage], pair.reference.answers[stage])
        end_to_end = structs.replace(end_to_end, **informative)
    outcome, ratio, reason = _conclusion(
        pair.reference.name, end_to_end, continued, stage, shared=shared, shared_continued=shared_continued
    )
    if pair.by_oracle and stage is Stage.RADIANCE and outcome is Outcome.PASS:
        pooled_ratio, why = _pooled(pair)
        ratio = max(ratio, pooled_ratio)
        if pooled_ratio > 1:
            outcome, reason = Outcome.FAIL, why
    examined = counted(kinds)
    steps = pair.one.because.get(stage, "") + pair.other.because.get(stage, "")
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
        because=_because(pair.reference.name, stage) + steps,
        examined=examined,
        cells=cells_of(kinds == Kind.WRONG) if examined.wrong else None,
    )


def _pooled(pair: RendererPair) -> tuple[float, str]:
    """Return the error over its limit of the mean radiance over all smooth pixels, and what is wrong with it.

    0 for a subject that draws no random numbers.
    """
    error = pair.subject.pooled_error
    if error is None:
        return 0.0, ""
    smooth = np.isfinite(error[..., 0])
    images = (pair.subject.answers, pair.base.truth)
    mean, expected = (image[Stage.RADIANCE][smooth].mean(axis=0) for image in images)
    limit = error[smooth][0] + pair.one.rounding_limit[smooth].mean(axis=0)
    ratio = np.divide(np.abs(mean - expected), limit, out=np.zeros(3), where=limit > 0)
    channel = int(np.argmax(ratio))
    return float(ratio[channel]), (
        f"the mean over {np.count_nonzero(smooth)} smooth pixels and all renders is {mean[channel]:.6g}, "
        f"not {expected[channel]:.6g} ({CHANNELS[channel]}), limit {limit[channel]:.3g}"
    )


def measured(against: AgainstOracle, pixels: StagePixels) -> Measurement:
    """Return the measurement of a renderer's stage against the expected value."""
    return measure(
        pixels.stage,
        against.renderer.answers[pixels.stage],
        pixels.value,
        pixels.limit,
        pixels.kinds,
        hit=against.base.conditioning.hit,
        precision=against.renderer.precision,
        compared=(pixels.ratio, pixels.error),
    )


def _because(reference: str, stage: Stage) -> str:
    """Return the derivation of the limit of a stage against a reference."""
    return f"{BECAUSE[stage]}; {reference}: {calibration(reference).origin}"


def _conclusion(
    reference: str,
    whole: Measurement,
    continued: Measurement | None,
    stage: Stage,
    *,
    shared: Factors | None,
    shared_continued: Factors | None,
) -> tuple[Outcome, float, str]:
    """Return the outcome of the measurements of a stage, the worst error over its limit, and the reason.

    `shared` and `shared_continued` are the factors that many pixels share, each of them within its own limit.
    """
    worst = whole if continued is None else max(whole, continued, key=lambda measurement: measurement.worst_ratio)
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


def _inform(image: np.ndarray, expected: np.ndarray) -> dict[str, Any]:
    """Return the informative metrics with the range to which they are relative; they decide nothing."""
    if not (np.isfinite(image).all() and np.isfinite(expected).all()):
        return {}
    value_range = (float(min(image.min(), expected.min())), float(max(image.max(), expected.max())))
    # No metric depends on the unit: scaling by a power of two, which is exact, avoids overflow in squares.
    unit = int(np.frexp(max(map(abs, value_range)))[1])
    image, expected = np.ldexp(image, -unit), np.ldexp(expected, -unit)
    scaled = (float(np.ldexp(value_range[0], -unit)), float(np.ldexp(value_range[1], -unit)))
    return {"metrics": {name: METRICS[name](image, expected, scaled) for name in METRICS}, "range": value_range}


def accounted(checks: Sequence[Check], scene: Scene) -> list[Check]:
    """Return the checks, each with its pixel counts; one with unexamined or wrong pixels is no pass."""
    return [_accounted(check, scene) for check in checks]


def _accounted(check: Check, scene: Scene) -> Check:
    counts = unexamined(check.stage, scene.camera) if check.examined is None else check.examined
    counted_check = structs.replace(check, examined=counts)
    # With a warning for a declared epsilon all other pixels are right; with a warning for a finding they are not.
    if check.outcome is not Outcome.PASS and (check.outcome is not Outcome.WARN or check.finding):
        return counted_check
    if counts.wrong:
        why = f"{counts.wrong} of {counts.pixels} pixels are wrong in a check that passes"
        return structs.replace(counted_check, outcome=Outcome.ERROR, reason=why)
    if counts.unexamined:
        why = f"{counts.unexamined} of {counts.pixels} pixels were held to nothing"
        return structs.replace(counted_check, outcome=Outcome.ERROR, reason=why)
    return counted_check


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
    """Return a check that ended before any measurement."""
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


# A check for every planned stage of one subject against one reference, even if it cannot be measured.


def pair_checks(
    pair: RendererPair, stages: Sequence[Stage], misshapen: Mapping[str, Mapping[Stage, str]]
) -> list[Check]:
    """Return a check for each of the stages.

    `misshapen` has, by renderer and stage, the reasons of images with the wrong size.
    """
    repeated = _repeated(pair)
    checks = []
    for stage in stages:
        # The first obstacle in this order determines the check.
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


def _declined(pair: RendererPair, stage: Stage) -> Check | None:
    """Return a check with the subject's own reason for a missing answer, None if it has an answer."""
    subject, about = pair.subject, (pair.subject, pair.reference, stage)
    if subject.error is not None:
        return unmeasured(*about, Outcome.ERROR, f"{subject.name}: {subject.error}", stopped=subject.stopped)
    if stage in subject.lacking:
        return unmeasured(*about, Outcome.MISSING, f"{subject.name}: {subject.lacking[stage]}")
    if stage in subject.unsupported:
        return unmeasured(*about, Outcome.UNSUPPORTED, f"{subject.name} cannot: {subject.unsupported[stage]}")
    return None


def _repeated(pair: RendererPair) -> dict[Stage, Check]:
    """Return checks of the stages whose numbers by the reference are copies of the subject's."""
    subject, reference = pair.subject, pair.reference
    single = subject.precision == reference.precision == "float32"
    stages = copied(subject.answers, reference.answers, pair.base.truth, both_float32=single)
    reason = f"{reference.name} repeats {subject.name} to the last bit: it is no witness"
    return {stage: unmeasured(subject, reference, stage, Outcome.REFERENCE_SUSPECT, reason) for stage in stages}


def _abstained(pair: RendererPair, stage: Stage) -> Check | None:
    subject, reference = pair.subject, pair.reference
    if reference.error is None:
        return None
    why = "was stopped by its time limit" if reference.stopped else "abstains"
    reason = f"{reference.name} {why}: {reference.error}"
    outcome = abstention(reference)
    return unmeasured(subject, reference, stage, outcome, reason, abstains=True, stopped=reference.stopped)


def _not_answered(pair: RendererPair, stage: Stage, misshapen: Mapping[Stage, str]) -> Check | None:
    about = pair.subject, pair.reference, stage
    if stage in misshapen:
        return unmeasured(*about, Outcome.FAIL, misshapen[stage])
    if stage not in pair.subject.answers:
        return unmeasured(*about, Outcome.UNSUPPORTED, f"{pair.subject.name} gave no {stage}")
    return None


def _not_answered_by_reference(pair: RendererPair, stage: Stage, misshapen: Mapping[Stage, str]) -> Check | None:
    about, name = (pair.subject, pair.reference, stage), pair.reference.name
    if stage in misshapen:
        return unmeasured(*about, Outcome.REFERENCE_SUSPECT, f"{name}'s {misshapen[stage]}: it is no witness")
    if stage not in pair.reference.answers:
        return unmeasured(*about, Outcome.MISSING, f"{name} gave no {stage}")
    return None


def _too_coarse(pair: RendererPair, stage: Stage) -> Check | None:
    """Return an `unsupported` check if the subject's output is too coarse for a stage, else None."""
    if stage is Stage.CAMERA:
        return None
    subject = pair.subject
    why = pair.one.coarseness.too_coarse(stage, pair.base.truth[stage])
    reason = f"{subject.name}: {why}"
    return None if why is None else unmeasured(subject, pair.reference, stage, Outcome.UNSUPPORTED, reason)
