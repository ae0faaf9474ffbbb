"""A check for every planned stage of one candidate before one witness; none is left out, whatever is in its way."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.check import Check, camera_check, stage_check, unmeasured
from rayproof.reports.judge.comparison.copied_answers import copied
from rayproof.reports.judge.comparison.pair import Bench
from rayproof.reports.judge.renderers import Candidate, Witness, abstention
from rayproof.reports.judge.tolerance.output_resolution import Coarseness
from rayproof.reports.results.outcomes import Outcome


@dataclass(frozen=True, kw_only=True)
class Obstacle:
    """Why a stage cannot be measured, and what its check ends in."""

    outcome: Outcome
    reason: str
    abstains: bool = False
    stopped: bool = False


def pair_checks(bench: Bench, stages: Sequence[Stage], misshapen: Mapping[str, Mapping[Stage, str]]) -> list[Check]:
    """Return a check for each of the stages.

    `misshapen` says by renderer and stage whose images have another size than was asked for.
    """
    candidate, witness = bench.candidate, bench.witness
    repeated = _repeated(bench)
    checks = []
    for stage in stages:
        # Of several obstacles the first in this order is told.
        obstacle = (
            _declined(candidate, stage)
            or repeated.get(stage)
            or _abstained(witness)
            or _not_answered(candidate, stage, misshapen[candidate.name])
            or _not_answered_by_witness(witness, stage, misshapen[witness.name])
            or _too_coarse(bench, stage)
        )
        if obstacle is not None:
            checks.append(unmeasured(candidate, witness, stage, **asdict(obstacle)))
        elif stage is Stage.CAMERA:
            checks.append(camera_check(bench))
        else:
            checks.append(stage_check(bench, stage))
    return checks


def _declined(candidate: Candidate, stage: Stage) -> Obstacle | None:
    """Return what the candidate itself said of its not answering."""
    name = candidate.name
    if candidate.answers is None:
        return Obstacle(outcome=Outcome.ERROR, reason=f"{name}: {candidate.error}", stopped=candidate.stopped)
    if stage in candidate.lacking:
        return Obstacle(outcome=Outcome.MISSING, reason=f"{name}: {candidate.lacking[stage]}")
    if stage in candidate.unsupported:
        return Obstacle(outcome=Outcome.UNSUPPORTED, reason=f"{name} cannot: {candidate.unsupported[stage]}")
    return None


def _repeated(bench: Bench) -> dict[Stage, Obstacle]:
    """Return the stages in which the witness has the candidate's own numbers."""
    candidate, witness = bench.candidate, bench.witness
    single = candidate.precision == witness.precision == "float32"
    stages = copied(candidate.answers or {}, witness.answers, bench.ground.truth, both_float32=single)
    reason = f"{witness.name} repeats {candidate.name} to the last bit: it is no witness"
    return {stage: Obstacle(outcome=Outcome.REFERENCE_SUSPECT, reason=reason) for stage in stages}


def _abstained(witness: Witness) -> Obstacle | None:
    if witness.error is None:
        return None
    why = "was stopped by its time limit" if witness.stopped else "abstains"
    reason = f"{witness.name} {why}: {witness.error}"
    return Obstacle(outcome=abstention(witness), reason=reason, abstains=True, stopped=witness.stopped)


def _not_answered(candidate: Candidate, stage: Stage, misshapen: Mapping[Stage, str]) -> Obstacle | None:
    if stage in misshapen:
        return Obstacle(outcome=Outcome.FAIL, reason=misshapen[stage])
    if stage not in (candidate.answers or {}):
        return Obstacle(outcome=Outcome.UNSUPPORTED, reason=f"{candidate.name} gave no {stage}")
    return None


def _not_answered_by_witness(witness: Witness, stage: Stage, misshapen: Mapping[Stage, str]) -> Obstacle | None:
    if stage in misshapen:
        reason = f"{witness.name}'s {misshapen[stage]}: it is no witness"
        return Obstacle(outcome=Outcome.REFERENCE_SUSPECT, reason=reason)
    if stage not in witness.answers:
        return Obstacle(outcome=Outcome.MISSING, reason=f"{witness.name} gave no {stage}")
    return None


def _too_coarse(bench: Bench, stage: Stage) -> Obstacle | None:
    """Return that the candidate's output keeps too little of a stage to tell anything."""
    if stage is Stage.CAMERA:
        return None
    candidate = bench.candidate
    why = Coarseness(resolutions=candidate.resolutions).too_coarse(stage, bench.ground.truth[stage])
    return None if why is None else Obstacle(outcome=Outcome.UNSUPPORTED, reason=f"{candidate.name}: {why}")
