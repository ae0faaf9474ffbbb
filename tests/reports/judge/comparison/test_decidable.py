"""What a renderer says that it does not see is excused, and there must be enough that it says it sees."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.cases.placement import translation
from rayproof.cases.scene import Camera, PointLight, Scene, Square
from rayproof.cases.stages import Stage
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.forward.limits import WHOLE
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.sentinels import EDGE_CASE, SIDE, edge_scene
from rayproof.reports.judge.verdict import Judged
from rayproof.reports.results.outcomes import Outcome
from tests.harness.verdicts.certify import certify
from tests.reports.judge.scenes import CASE, ORACLE, candidate, rounded, truth, witness

FAR_ABOVE_ALL = 1e9  # m
EXACT = (Stage.CAMERA, *WHOLE)
TRACER = frozenset({"CAM-4"})  # whose promises bind


@pytest.mark.parametrize("epsilon", ["ray_epsilon", "shadow_epsilon"])
@pytest.mark.parametrize("tuned", [True, False])
def test_an_epsilon_that_swallows_the_image_hides_nothing_wrong_and_costs_nothing_right(epsilon, tuned):
    answers = rounded(truth())
    wrong = answers | {stage: 3 * answers[stage] for stage in (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)}
    case = replace(CASE, least_interior=0, tuned=tuned)
    outcomes = []

    for ours in (answers, wrong):
        blind = replace(candidate(ours), chained=False, **{epsilon: FAR_ABOVE_ALL})
        outcomes.append(judge_case(case, [blind], [witness(truth())], ORACLE, {}).outcome)

    assert outcomes == [Outcome.PASS, Outcome.FAIL]


@pytest.mark.parametrize(("least", "outcome"), [(228, Outcome.PASS), (229, Outcome.ERROR)])
def test_a_pixel_that_rounding_explains_is_not_within_its_limits(least, outcome):
    """All 16 x 16 pixels hit something, and at the centres of 28, a frame of 8 x 8, the border's other side is seen."""
    scene = EDGE_CASE.scene
    answers = ORACLE.render(scene, stages_of(scene))
    shown = (ORACLE.render(edge_scene(SIDE * (1 + part)), stages_of(scene)) for part in (1e-9, -1e-9))
    other = next(one for one in shown if (one[Stage.OBJECT] != answers[Stage.OBJECT]).any())
    case = replace(EDGE_CASE, scene=scene, least_interior=least)

    found = judge_case(case, [replace(candidate(rounded(other)), items=TRACER)], [witness(answers)], ORACLE, {})

    assert found.outcome is outcome, found.reason
    (check,) = (check for check in found.checks if check.stage is Stage.RADIANCE)
    assert check.end_to_end is not None
    assert (check.end_to_end.interior, check.end_to_end.explained) == (228, 28)


def test_what_is_missed_before_the_eye_counts_against_what_a_case_lets_be_explained():
    answers = truth()
    near = float(np.median(answers[Stage.DISTANCE][answers[Stage.OBJECT][..., 0] == 0]))
    beyond = replace(CASE.scene, camera=replace(CASE.scene.camera, near=near, far=1e3), clip="shell")
    missed = (answers[Stage.DISTANCE] < near) & (answers[Stage.OBJECT][..., :1] >= 0)
    seen = ORACLE.render(beyond, tuple(stage for stage in answers if stage is not Stage.CAMERA))
    ours = answers | {stage: np.where(missed, image, answers[stage]) for stage, image in seen.items()}
    some = replace(candidate(rounded(ours)), ray_epsilon=near)

    found = judge_case(replace(CASE, least_interior=0), [some], [witness(answers)], ORACLE, {})

    assert found.outcome is Outcome.FAIL


def apart(height: float) -> Case:
    """Return a case that nobody tuned: two squares, one `height` [m] above the other, seen from above."""
    camera = Camera(
        eye=(0.3, -2.0, 9.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fovy=4, width=12, height=9, near=0.1, far=99
    )  # fmt: skip
    squares = tuple(Square(albedo=(0.5, 0.4, 0.3), to_world=translation(0.0, 0.0, at)) for at in (0.0, height))
    light = PointLight(position=(1.0, 2.0, 5.0), flux=(10.0, 20.0, 30.0))
    return replace(CASE, scene=Scene(camera=camera, shapes=squares, lights=(light,)), most_explained=0.5, tuned=False)


def lower_of(case: Case) -> dict:
    """Return the answers of who sees the square that the oracle does not see."""
    answers = ORACLE.render(case.scene, stages_of(case.scene))
    answers[Stage.OBJECT] = np.stack([1 - answers[Stage.OBJECT][..., 0], answers[Stage.OBJECT][..., 1]], axis=-1)
    stages = stages_of(case.scene)
    for stage in stages[stages.index(Stage.DISTANCE) :]:
        answers[stage] = ORACLE.continue_from(case.scene, stage, answers)
    return answers


def judged_apart(height: float, *, others: tuple[str, ...] = ("float32",)) -> Judged:
    """Judge renderers of both precisions on it, of which `others` name the lower square everywhere."""
    case = apart(height)
    right = ORACLE.render(case.scene, stages_of(case.scene))
    # In numbers of its own, a rounding away: who repeats another to the last bit is a copy.
    fine = {stage: image if stage in EXACT else image * (1 + 2.0**-52) for stage, image in right.items()}
    fine_lower = {stage: image if stage in EXACT else image * (1 + 2.0**-52) for stage, image in lower_of(case).items()}
    single = rounded(lower_of(case)) if "float32" in others else rounded(right)
    double = fine_lower if "float64" in others else fine
    both = [candidate(single), replace(candidate(double, name="float64"), precision="float64", shadow_epsilon=0)]
    return judge_case(case, both, [witness(right)], ORACLE, {})


def test_what_one_precision_cannot_decide_the_other_decides():
    found = judged_apart(1e-6)

    outcomes = {(check.configuration, check.stage): check.outcome for check in found.checks}
    assert outcomes["float32", Stage.OBJECT] is Outcome.UNDECIDED
    assert outcomes["float64", Stage.OBJECT] is outcomes["float64", Stage.RADIANCE] is Outcome.PASS
    assert found.outcome is Outcome.PASS


def test_what_nobody_can_decide_is_undecided_and_no_pass():
    found = judged_apart(0.0, others=("float32", "float64"))

    assert {check.outcome for check in found.checks if check.stage is Stage.RAY} == {Outcome.PASS}
    assert {check.outcome for check in found.checks if check.stage is Stage.OBJECT} == {Outcome.UNDECIDED}
    reasons = [check.reason for check in found.checks if check.stage is Stage.OBJECT]
    assert all("rounding explains 1.0000 of the pixels" in reason for reason in reasons)


def test_a_reference_that_crashed_abstains_and_one_that_was_lost_is_missing():
    ours, right = candidate(rounded(truth())), witness(truth())
    fallen = replace(witness({}, name="radiance"), error="no answer within 120 s; stopped")

    abstains = judge_case(CASE, [ours], [right, fallen], ORACLE, {}, panel=("analytic", "radiance"))
    lost = judge_case(CASE, [ours], [right], ORACLE, {}, panel=("analytic", "radiance"))

    assert abstains.planned == lost.planned == len(abstains.checks) == len(lost.checks) == 2 * len(Stage)
    assert abstains.outcome is Outcome.PASS
    assert {check.outcome for check in abstains.checks if check.reference == "radiance"} == {Outcome.UNDECIDED}
    assert "no answer within 120 s" in abstains.checks[-1].reason
    assert not any(check.stopped for check in abstains.checks)
    assert lost.outcome is Outcome.MISSING


def test_whom_a_time_limit_stopped_is_told_apart_from_what_cannot_be_decided():
    late = {"error": "no answer within 120 s; stopped", "stopped": True}
    ours, right = candidate(rounded(truth())), witness(truth())
    reference, tested = replace(witness({}, name="radiance"), **late), replace(ours, name="slow", answers={}, **late)

    found = judge_case(CASE, [ours, tested], [right, reference], ORACLE, {})
    named = certify(found, [ours, tested], [right, reference], ORACLE)

    stopped = {(check.configuration, check.reference) for check in found.checks if check.recorded().stopped}
    assert stopped == {("float32", "radiance"), ("slow", "analytic"), ("slow", "radiance")}
    assert "radiance was stopped by its time limit" in "".join(check.reason for check in found.checks)
    assert (named.stopped, named.undecided, named.undecidable, named.abstained) == (("radiance", "slow"), (), (), ())


def test_what_a_renderer_does_not_see_before_a_light_is_counted_and_hides_nothing_else():
    (case,) = select(["along_the_way/before_the_light"])
    right = ORACLE.render(case.scene, stages_of(case.scene))
    blind = replace(candidate(rounded(right)), light_epsilon=1e-3)
    dark = rounded(right) | {stage: 0 * right[stage] for stage in (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)}

    found = judge_case(case, [blind], [witness(right)], ORACLE, {})
    wrong = judge_case(case, [replace(blind, answers=dark)], [witness(right)], ORACLE, {})

    assert (found.outcome, wrong.outcome) == (Outcome.PASS, Outcome.FAIL)
