"""A declared epsilon beyond what rounding needs is said, counted and costs who declares it; it never hides garbage."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.results.case_records import Check
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.scenes import case_of_file
from tests.reports.judge.scenes import CASE, ORACLE, candidate, followed, rounded, truth_of_scene, witness

WIDE = 0.098  # m: of examples/still_life.json, whose shapes lie 5 to 9 m from the eye
EXAMPLES = Path(__file__).parents[4] / "examples"


@cache
def still_life() -> Case:
    """Return an example's case."""
    return case_of_file(EXAMPLES / "still_life.json")


def checked(case: Case, mine: Answers, stage: Stage = Stage.RADIANCE) -> Check:
    """Return the check of one stage before the oracle."""
    judged = judge_case(case, [mine], [witness(dict(truth_of_scene(case.scene).truth))], ORACLE, {})
    return next(check for check in judged.checks if check.stage is stage)


def count(check: Check, kind: Kind) -> int:
    """Return how many pixels of a check are of a kind, end to end."""
    assert check.end_to_end is not None
    return int(np.count_nonzero(check.end_to_end.kinds == kind))


def lifted(case: Case, height: float) -> dict:
    """Return a float32 renderer's answers whose shadow rays start so high [m] above the hit."""
    truth = truth_of_scene(case.scene).truth
    rows = {stage: image.reshape(-1, image.shape[-1]) for stage, image in truth.items() if stage is not Stage.CAMERA}
    raised = rows | {Stage.POSITION: rows[Stage.POSITION] + height * rows[Stage.NORMAL]}
    seen = ORACLE.visibility(case.scene, raised).reshape(truth[Stage.VISIBILITY].shape)
    return followed(case.scene, truth, Stage.VISIBILITY, seen)


@pytest.mark.parametrize("staged", [True, False], ids=["staged", "radiance-alone"])
def test_who_lifts_shadow_rays_is_told_that_only_its_epsilon_explains_them(staged):
    ours = lifted(still_life(), WIDE)
    kept = ours if staged else {Stage.RADIANCE: ours[Stage.RADIANCE]}
    unable = {stage: "radiance alone" for stage in Stage if stage not in kept}
    mine = replace(candidate(kept), chained=False, unsupported=unable, shadow_epsilon=WIDE)

    right, undeclared = checked(still_life(), mine), checked(still_life(), replace(mine, shadow_epsilon=0.0))

    assert count(right, Kind.WRONG) == 0
    assert count(right, Kind.EPSILON) > 50
    assert right.outcome in (Outcome.WARN, Outcome.FAIL)
    assert "explained only by the epsilon" in right.reason
    assert undeclared.outcome is Outcome.FAIL
    assert count(undeclared, Kind.WRONG) > 50


def test_garbage_under_a_wide_shadow_epsilon_fails():
    truth = truth_of_scene(still_life().scene).truth
    changed = (lifted(still_life(), WIDE)[Stage.VISIBILITY] != truth[Stage.VISIBILITY]).any(axis=-1)
    garbage = np.where(changed[..., np.newaxis], 1e30, rounded(dict(truth))[Stage.RADIANCE])
    unable = {stage: "radiance alone" for stage in Stage if stage is not Stage.RADIANCE}
    mine = replace(candidate({Stage.RADIANCE: garbage}), chained=False, unsupported=unable, shadow_epsilon=WIDE)

    check = checked(still_life(), mine)

    assert changed.sum() > 50
    assert (check.outcome, count(check, Kind.WRONG)) == (Outcome.FAIL, changed.sum())


@pytest.mark.parametrize("staged", [True, False], ids=["staged", "radiance-alone"])
def test_what_lies_beyond_a_ray_epsilon_may_be_seen(staged):
    truth = truth_of_scene(CASE.scene).truth
    epsilon = float(np.median(truth[Stage.DISTANCE][truth[Stage.OBJECT][..., 0] == 0]))
    camera = replace(CASE.scene.camera, near=epsilon, far=1e3)
    beyond = ORACLE.render(replace(CASE.scene, camera=camera, clip="shell"), tuple(truth))
    near = (truth[Stage.DISTANCE] < epsilon) & (truth[Stage.OBJECT][..., :1] >= 0)
    images = {
        stage: np.where(near, beyond[stage], image) for stage, image in truth.items() if stage is not Stage.CAMERA
    }
    ours = rounded(images) if staged else {Stage.RADIANCE: rounded(images)[Stage.RADIANCE]}
    unable = {stage: "It has none." for stage in Stage if stage not in ours}
    mine = replace(candidate(ours), chained=False, unsupported=unable, ray_epsilon=epsilon)

    check = checked(CASE, mine)

    assert near.sum() > 50
    assert check.outcome in (Outcome.WARN, Outcome.FAIL), "too many pixels for what rounding needs"
    assert count(check, Kind.WRONG) == 0
    assert count(check, Kind.EPSILON) > 50


def test_a_references_epsilon_costs_its_word_and_not_the_case():
    case, answers = still_life(), dict(truth_of_scene(still_life().scene).truth)
    blind = witness(lifted(case, WIDE), name="radiance", precision="float32", shadow_epsilon=WIDE)
    mine = replace(candidate(rounded(answers)), chained=False, shadow_epsilon=1e-7)

    judged = judge_case(case, [mine], [witness(answers), blind], ORACLE, {})
    measured: list[Check] = [check for check in judged.checks if check.end_to_end is not None]

    assert {check.outcome for check in measured} == {Outcome.PASS}
    seen = {check.reference: count(check, Kind.EPSILON) for check in measured if check.stage is Stage.RADIANCE}
    assert seen["analytic"] == 0
    assert seen["radiance"] > 50
