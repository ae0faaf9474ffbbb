"""A declared epsilon excuses sides, never garbage, and beyond what rounding needs it is said and counted."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.results.case_records import Check
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.tracer_task import shadow_epsilons
from rayproof.tracer.configuration import Configuration
from tests.reports.judge.scenes import CASE, ORACLE, rounded, witness
from tests.reports.judge.tolerance.test_edge_light import case_named, checked, kinds_of, ledger, party, terms, truth_of

WIDE, DEEP = 0.098, 7.84  # m: of examples/still_life.json, whose shapes lie 5 to 9 m from the eye


def test_garbage_under_a_wide_shadow_epsilon_fails_and_what_is_right_warns():
    ours = rounded(truth_of("still_life"))
    mine = party(ours, staged=False, shadow_epsilon=WIDE)
    window = terms("still_life", mine).window
    garbage = np.where(window[..., np.newaxis], 1e30, ours[Stage.RADIANCE])

    spoilt = checked("still_life", replace(mine, answers={Stage.RADIANCE: garbage}))
    right = checked("still_life", mine)
    shadowed = checked(
        "still_life",
        replace(mine, answers={Stage.RADIANCE: np.where(window[..., np.newaxis], 0.0, ours[Stage.RADIANCE])}),
    )

    assert window.sum() > 5000
    assert (spoilt.outcome, ledger(spoilt).wrong) == (Outcome.FAIL, window.sum())
    assert (right.outcome, ledger(right).epsilon) == (Outcome.WARN, 0)
    assert "pixels are left undecided only by the epsilon" in right.reason
    # Where both lights are undecided none of them need count, and nowhere else.
    assert shadowed.outcome is Outcome.FAIL
    assert ledger(shadowed).epsilon > 0


def test_garbage_under_a_deep_ray_epsilon_fails():
    ours = rounded(truth_of("still_life"))
    mine = party(ours, staged=True, ray_epsilon=DEEP)
    near = terms("still_life", mine).near
    wrong = (Stage.DISTANCE, Stage.POSITION, Stage.NORMAL, Stage.RADIANCE)
    spoilt = ours | {stage: np.where(near[..., np.newaxis], 0.7 * ours[stage], ours[stage]) for stage in wrong}

    assert near.mean() > 0.4
    for stage in wrong:
        assert checked("still_life", replace(mine, answers=spoilt), stage).outcome is Outcome.FAIL, stage


@pytest.mark.parametrize("staged", [True, False], ids=["staged", "radiance-alone"])
def test_what_lies_beyond_a_ray_epsilon_may_be_seen(staged):
    epsilon = float(np.median(truth_of("ball")[Stage.DISTANCE][truth_of("ball")[Stage.OBJECT][..., 0] == 0]))
    camera = replace(CASE.scene.camera, near=epsilon, far=1e3)
    beyond = ORACLE.render(replace(CASE.scene, camera=camera, clip="shell"), tuple(truth_of("ball")))
    near = terms("ball", party(rounded(beyond), staged=staged, ray_epsilon=epsilon)).near
    images = {
        stage: np.where(near[..., np.newaxis], beyond[stage], image)
        for stage, image in truth_of("ball").items()
        if stage is not Stage.CAMERA
    }
    mine = party(rounded(images), staged=staged, ray_epsilon=epsilon)

    check = checked("ball", mine)

    assert near.sum() > 50
    assert check.outcome in (Outcome.WARN, Outcome.FAIL), "too many pixels for what rounding needs"
    assert ledger(check).wrong == 0
    assert ledger(check).epsilon > 50
    assert (kinds_of(check)[near] != Kind.WRONG).all()


def test_the_tracers_own_clearance_passes_and_twenty_times_as_much_does_not():
    case = case_named("acne/contact")
    answers = truth_of(case.name)
    declared = shadow_epsilons(case.scene, answers, Configuration.parse("float32"))
    outcomes = []
    for times in (1, 20):
        mine = Answers(
            name="float32",
            precision="float32",
            items=frozenset({"CAM-4"}),
            shadow_epsilon=times * declared,
            answers=rounded(answers),
        )
        outcomes.append(judge_case(case, [mine], [witness(answers)], ORACLE, {}).outcome)

    assert outcomes[0] is Outcome.PASS
    assert outcomes[1] is not Outcome.PASS


def test_a_references_epsilon_costs_its_word_and_not_the_case():
    answers = truth_of("still_life")
    blind = replace(witness(answers, name="radiance"), shadow_epsilon=WIDE)
    mine = party(rounded(answers), staged=True, shadow_epsilon=1e-7)

    judged = judge_case(case_named("still_life"), [mine], [witness(answers), blind], ORACLE, {})
    measured: list[Check] = [check for check in judged.checks if check.end_to_end is not None]

    assert {check.outcome for check in measured} == {Outcome.PASS}
    seen = {check.reference: check.end_to_end for check in measured if check.stage is Stage.RADIANCE}
    assert seen["analytic"] is not None
    assert seen["radiance"] is not None
    assert seen["analytic"].in_window == 0
    assert seen["radiance"].in_window > 5000
