"""A coarse output is judged by its own steps: no step more, and none less."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.stages import Resolution, Stage
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.measurement import Kind, held_to
from rayproof.reports.results.outcomes import Outcome
from tests.reports.judge.scenes import CASE, ORACLE, SCENE, candidate, rounded, truth, witness

STEP = 2.0**-16
LEVELS = Resolution(relative=0.0, absolute=STEP / 2, because="rounded to 1/65536 for this test")
# Where a stage may lie: vectors and light by their own sizes.
COARSE = (Stage.DISTANCE, Stage.POSITION, Stage.NORMAL, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


def stepped(*stages: Stage) -> dict:
    """Return the oracle's answers, but for their last bits, with some stages written in steps."""
    answers = truth()
    for stage in (Stage.RAY, *COARSE):
        answers[stage] = answers[stage] * (1 + 2.0**-52)
    for stage in stages:
        answers[stage] = np.round(answers[stage] / STEP) * STEP
    return answers


def judged(answers: dict, *stages: Stage, resolution: Resolution = LEVELS):
    """Judge a float64 candidate that declares steps for some stages."""
    ours = replace(candidate(answers), precision="float64", resolutions=dict.fromkeys(stages, resolution))
    return judge_case(CASE, [ours], [witness(truth())], ORACLE, {})


@pytest.mark.parametrize("stage", COARSE, ids=str)
def test_a_stage_in_steps_passes_where_they_are_declared_and_only_there(stage):
    answers = stepped(stage)

    assert judged(answers, stage).outcome is Outcome.PASS
    assert judged(answers).outcome is Outcome.FAIL


@pytest.mark.parametrize("stage", [Stage.DISTANCE, Stage.RADIANCE], ids=str)
def test_one_step_more_than_declared_fails(stage):
    answers = stepped(stage)
    hit = answers[Stage.OBJECT][..., :1] >= 0
    answers[stage] = answers[stage] + np.where(hit & np.isfinite(answers[stage]), STEP, 0.0)

    found = judged(answers, stage)

    assert (found.outcome, found.stage) == (Outcome.FAIL, stage)


def test_a_witness_in_steps_is_no_reason_to_fail_an_exact_renderer():
    coarse = witness(stepped(Stage.RADIANCE), name="sixteen", resolutions={Stage.RADIANCE: LEVELS})

    found = judge_case(CASE, [candidate(rounded(truth()))], [witness(truth()), coarse], ORACLE, {})

    assert found.outcome is Outcome.PASS, found.reason
    (check,) = (c for c in found.checks if c.stage is Stage.RADIANCE and c.reference == "sixteen")
    assert "1/65536" in str(check.recorded().because)
    assert str(check.recorded().because).count("1/65536") == 1


def test_an_output_too_coarse_to_tell_anything_is_no_pass():
    coarse = Resolution(relative=0.5, absolute=0.0, because="a single bit")

    found = judged(stepped(), Stage.RADIANCE, resolution=coarse)

    assert found.outcome is Outcome.UNSUPPORTED
    assert "a single bit" in found.reason


def test_hits_within_a_partys_own_epsilon_are_counted_apart():
    answers = truth()
    seen = answers[Stage.OBJECT][..., 0] == 0
    nearest = float(answers[Stage.DISTANCE][seen].min())
    reach = nearest + 0.05 * (float(answers[Stage.DISTANCE][seen].max()) - nearest)
    near = seen & (answers[Stage.DISTANCE][..., 0] <= reach)
    beyond = replace(SCENE, camera=replace(SCENE.camera, near=reach, far=1e3), clip="shell")
    seen_beyond = ORACLE.render(beyond, tuple(stage for stage in answers if stage is not Stage.CAMERA))
    blind = answers | {s: np.where(near[..., np.newaxis], image, answers[s]) for s, image in seen_beyond.items()}
    stages = (Stage.CAMERA, Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)
    rest = {stage: "Not asked." for stage in Stage if stage not in stages}
    theirs = {stage: blind[stage] for stage in stages}
    honest = witness(theirs, name="blind", unsupported=rest, ray_epsilon=reach)

    found = judge_case(CASE, [candidate(rounded(answers))], [witness(answers), honest], ORACLE, {})

    assert 0 < np.count_nonzero(near) < 200
    assert found.outcome is Outcome.PASS, found.reason
    (check,) = (c for c in found.checks if c.stage is Stage.OBJECT and c.reference == "blind")
    assert check.end_to_end is not None
    kinds = found.against["blind"].end_to_end[Stage.DISTANCE].kinds
    assert np.count_nonzero(kinds == Kind.EPSILON) == np.count_nonzero(near)
    without = replace(honest, ray_epsilon=0.0)
    assert judge_case(CASE, [candidate(rounded(answers))], [witness(answers), without], ORACLE, {}).outcome in (
        Outcome.REFERENCE_SUSPECT,
    )


@pytest.mark.parametrize("stage", [Stage.RADIANCE, Stage.POSITION])
def test_the_step_of_a_file_at_black_pixels_and_misses_is_no_wide_limit(stage: Stage):
    """Of a `chained` program each output is coarse by 2^-150 at least, of which a value of 0 has no share."""
    theirs, size = np.zeros((1, 3, 3)), np.zeros((1, 3))
    limit = np.array([[2.0**-150, 2.0**-40, 0.0]])

    wide, bounded = held_to(stage, limit, theirs, size if stage is Stage.POSITION else None)

    assert wide.tolist() == [[False, True, False]]
    assert bounded.all()
