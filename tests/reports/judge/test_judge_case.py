"""What the judge must see, whom it must blame, and what it must never let pass."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.case import PixelValue
from rayproof.cases.placement import frontal_fovy
from rayproof.cases.scene import Cube, Scene, Square
from rayproof.cases.stages import Stage
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.measurement import cells_of
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.sentinels import EDGE_CASE, HEIGHT, PIXEL
from rayproof.reports.results.outcomes import Outcome
from tests.reports.judge.scenes import (
    CASE,
    FLOOR,
    ITEMS,
    ORACLE,
    SCENE,
    candidate,
    put,
    rounded,
    truth,
    verdict,
    witness,
)

FACTORS = {
    Stage.RAY: 1 + 1e-4,
    Stage.DISTANCE: 1 + 1e-4,
    Stage.POSITION: 1 + 1e-4,
    Stage.NORMAL: 1 + 1e-3,
    Stage.IRRADIANCE: 1 + 1e-3,
    Stage.EXITANCE: 1 + 1e-3,
    Stage.RADIANCE: 1 + 1e-3,
}


def test_a_faultless_float32_renderer_passes_every_check():
    judged = verdict(rounded(truth()))

    assert judged.outcome is Outcome.PASS, judged.reason
    assert len(judged.checks) == judged.planned == len(Stage)
    assert judged.stage is None


@pytest.mark.parametrize("stage", FACTORS, ids=str)
def test_a_stage_scaled_by_a_little_fails_and_is_blamed(stage):
    ours = rounded(truth())
    ours[stage] = ours[stage] * FACTORS[stage]

    judged = verdict(ours)

    assert judged.outcome is Outcome.FAIL
    assert judged.stage is stage


def test_a_wrong_normal_with_all_that_follows_from_it_is_blamed_on_the_normal():
    ours = rounded(truth())
    tilted = ours[Stage.NORMAL] + 1e-2 * np.array([0.0, 1.0, 0.0]) * (ours[Stage.OBJECT][..., :1] >= 0)
    length = np.linalg.norm(tilted, axis=-1, keepdims=True)
    ours[Stage.NORMAL] = np.divide(tilted, length, out=np.zeros_like(tilted), where=length > 0)
    for stage in (Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE):
        ours[stage] = ORACLE.continue_from(SCENE, stage, ours)

    judged = verdict(ours)

    assert (judged.outcome, judged.stage) == (Outcome.FAIL, Stage.NORMAL)
    failed = {check.stage for check in judged.checks if check.outcome is Outcome.FAIL}
    assert Stage.RADIANCE in failed, "end to end the radiance is wrong too"
    assert judged.blamed == ("XF-2", "NRM-1", "NRM-3")


def interior_of(index: int) -> tuple[int, int]:
    """Return the row and column of the pixel of a shape that is farthest from every outline."""
    seen = truth()[Stage.OBJECT][..., 0] == index
    others = np.argwhere(~seen)
    pixels = np.argwhere(seen)
    apart = np.linalg.norm(pixels[:, np.newaxis] - others, axis=-1).min(axis=1)
    row, column = pixels[int(apart.argmax())]
    return int(row), int(column)


@pytest.mark.parametrize("wrong", [-1.0, 1.0], ids=["missed", "another-object"])
def test_one_interior_pixel_with_the_wrong_object_fails_and_is_counted(wrong):
    ours = rounded(truth())
    row, column = interior_of(0)
    ours[Stage.OBJECT][row, column, 0] = wrong

    judged = verdict(ours)

    check = next(check for check in judged.checks if check.stage is Stage.OBJECT)
    assert judged.outcome is Outcome.FAIL
    assert judged.stage is Stage.OBJECT
    assert check.end_to_end is not None
    assert check.end_to_end.hit_miss == 1
    assert check.end_to_end.pixel == (column, row)


def test_a_miss_that_should_be_a_hit_is_never_dropped_from_the_distance():
    ours = rounded(truth())
    row, column = interior_of(0)
    ours[Stage.DISTANCE][row, column] = np.inf

    check = next(check for check in verdict(ours).checks if check.stage is Stage.DISTANCE)

    assert check.outcome is Outcome.FAIL
    assert check.end_to_end is not None
    assert check.end_to_end.hit_miss == 1


@pytest.mark.parametrize("bad", [np.nan, np.inf], ids=str)
@pytest.mark.parametrize("stage", [Stage.NORMAL, Stage.IRRADIANCE, Stage.RADIANCE], ids=str)
def test_nan_and_infinity_are_counted_and_fail(bad, stage):
    ours = rounded(truth())
    row, column = interior_of(1)
    ours[stage][row, column, 0] = bad

    judged = verdict(ours)

    check = next(check for check in judged.checks if check.stage is stage)
    assert check.outcome is Outcome.FAIL
    assert check.end_to_end is not None
    assert check.end_to_end.nan + check.end_to_end.inf == 1


def test_images_of_another_size_are_an_error_line_not_broadcast():
    ours = rounded(truth())
    ours[Stage.RADIANCE] = ours[Stage.RADIANCE][:1]

    check = next(check for check in verdict(ours).checks if check.stage is Stage.RADIANCE)

    assert check.outcome is Outcome.FAIL
    assert "shape" in check.reason


def test_a_stage_that_was_planned_and_not_given_is_no_pass():
    ours = rounded(truth())
    del ours[Stage.RADIANCE]
    theirs = truth()
    del theirs[Stage.EXITANCE]

    of_ours = verdict(ours)
    of_theirs = judge_case(CASE, [candidate(rounded(truth()))], [witness(theirs)], ORACLE, {})

    assert of_ours.outcome is Outcome.UNSUPPORTED
    assert of_theirs.outcome is Outcome.MISSING
    assert len(of_theirs.checks) == of_theirs.planned


def test_a_stage_that_the_candidate_says_it_cannot_do_is_unsupported_even_where_it_answers():
    ours = replace(candidate(rounded(truth())), unsupported={Stage.NORMAL: "It has no normals."})

    judged = judge_case(CASE, [ours], [witness(truth())], ORACLE, {})

    (check,) = (check for check in judged.checks if check.stage is Stage.NORMAL)
    assert (judged.outcome, check.outcome) == (Outcome.UNSUPPORTED, Outcome.UNSUPPORTED)
    assert "It has no normals." in check.reason
    assert len(judged.checks) == judged.planned


def test_a_crashed_renderer_is_an_error_in_every_check_that_was_planned():
    judged = judge_case(CASE, [candidate({}, error="signal SIGSEGV")], [witness(truth())], ORACLE, {})

    assert judged.outcome is Outcome.ERROR
    assert len(judged.checks) == judged.planned > 0
    assert "SIGSEGV" in judged.reason


def test_a_reference_that_alone_disagrees_is_suspect_and_the_tracer_is_not_blamed():
    theirs = rounded(truth())
    theirs[Stage.RADIANCE] = theirs[Stage.RADIANCE] * 1.01

    judged = verdict(rounded(truth()), witness(theirs, name="mitsuba_scalar", precision="float32"))

    assert judged.outcome is Outcome.REFERENCE_SUSPECT
    assert "mitsuba_scalar" in judged.reason
    assert judged.blamed == ()


def test_a_wrong_oracle_is_suspect_when_an_independent_reference_sides_with_the_tracer():
    wrong = truth()
    wrong[Stage.RADIANCE] = wrong[Stage.RADIANCE] * 1.01
    third = witness(truth(), name="mitsuba_scalar", precision="float32")

    judged = judge_case(CASE, [candidate(rounded(truth()))], [witness(wrong), third], ORACLE, {})

    assert judged.outcome is Outcome.REFERENCE_SUSPECT


def test_when_all_references_agree_against_the_tracer_it_fails():
    ours = rounded(truth())
    ours[Stage.RADIANCE] = ours[Stage.RADIANCE] * 1.01
    third = witness(truth(), name="mitsuba_scalar", precision="float32")

    judged = verdict(ours, third)

    assert (judged.outcome, judged.stage, judged.blamed) == (Outcome.FAIL, Stage.RADIANCE, ("NRM-3", "RAD-4"))
    assert all(check.outcome is Outcome.FAIL for check in judged.checks if check.stage is Stage.RADIANCE)


@pytest.mark.parametrize(
    ("items", "outcome"), [(frozenset({"CAM-4"}), Outcome.ERROR), (ITEMS, Outcome.UNDECIDED)], ids=["tracer", "other"]
)
def test_a_case_with_too_little_to_judge_is_no_pass(items, outcome):
    ours = replace(candidate(rounded(truth())), items=items)

    judged = judge_case(replace(CASE, least_interior=1200), [ours], [witness(truth())], ORACLE, {})

    (check,) = (check for check in judged.checks if check.stage is Stage.RADIANCE)
    assert check.outcome is outcome
    assert "are within their limits, the case asks for 1200" in check.reason


def test_a_closed_form_that_does_not_hold_fails_though_all_references_agree():
    row, column = interior_of(1)
    value = float(truth()[Stage.IRRADIANCE][row, column, 0]) * 1.001
    wrong = PixelValue(
        stage=Stage.IRRADIANCE, column=column, row=row, channel=0, value=value, relative=1e-5, because="a test"
    )

    judged = verdict(rounded(truth()), case=replace(CASE, expectations=(wrong,)))

    assert (judged.outcome, judged.stage) == (Outcome.FAIL, Stage.IRRADIANCE)


@pytest.mark.parametrize("part", ["view", "view_inverse", "projection", "frustum_corners", "ndc", "pixel"])
def test_a_wrong_camera_part_fails_and_is_the_tracers_own(part):
    ours = rounded(truth())
    ours[Stage.CAMERA] = dict(ours[Stage.CAMERA])
    ours[Stage.CAMERA][part] = ours[Stage.CAMERA][part] + 1e-3

    judged = verdict(ours)

    assert (judged.outcome, judged.stage) == (Outcome.FAIL, Stage.CAMERA)
    assert judged.blamed == ("CAM-1", "CAM-2", "CAM-3", "CAM-5")


def test_a_wrong_camera_of_the_oracle_is_the_oracles():
    theirs = truth()
    theirs[Stage.CAMERA] = dict(theirs[Stage.CAMERA])
    theirs[Stage.CAMERA]["projection"] = theirs[Stage.CAMERA]["projection"] * 1.001

    judged = judge_case(CASE, [candidate(rounded(truth()))], [witness(theirs)], ORACLE, {})

    assert judged.outcome is Outcome.REFERENCE_SUSPECT


def test_a_witness_that_repeats_the_tracer_to_the_last_bit_is_no_witness():
    ours = rounded(truth())
    ours[Stage.RADIANCE] = ours[Stage.RADIANCE] * 1.01

    judged = judge_case(CASE, [candidate(ours)], [witness(ours)], ORACLE, {})

    assert judged.outcome is Outcome.REFERENCE_SUSPECT
    assert "last bit" in judged.reason


def test_outlines_that_rounding_carries_beyond_the_image_are_an_error_and_nobodys_failure():
    # Coordinates of a hundred thousand kilometres: a float32 hit is hundreds of pixels wide, and no side is known.
    far = 1e8
    shifted = ((1.0, 0.0, 0.0, far), (0.0, 1.0, 0.0, -far), (0.0, 0.0, 1.0, 0.5), (0.0, 0.0, 0.0, 1.0))
    scene = Scene(
        camera=replace(CASE.scene.camera, eye=(far + 3.0, -far - 4.0, 2.5), target=(far, -far, 0.3)),
        shapes=(Cube(albedo=(0.5, 0.5, 0.5), to_world=shifted), FLOOR),
    )
    answers = ORACLE.render(scene, stages_of(scene))
    ours = {Stage.NORMAL: np.roll(rounded(answers)[Stage.NORMAL], 3, axis=0)}
    unable = {stage: "It has none." for stage in Stage if stage is not Stage.NORMAL}
    case = replace(CASE, scene=scene, least_interior=0, most_explained=0.5)

    for items, outcome in ((frozenset({"CAM-4"}), Outcome.ERROR), (ITEMS, Outcome.UNDECIDED)):
        subject = replace(candidate(ours), unsupported=unable, items=items)
        judged = judge_case(case, [subject], [witness(answers)], ORACLE, {})

        (check,) = (check for check in judged.checks if check.stage is Stage.NORMAL)
        assert check.examined is not None
        assert check.examined.unexamined > 20
        assert check.outcome is outcome
        assert "held to nothing" in check.reason


def test_a_case_whose_every_hit_is_explained_by_rounding_is_no_pass():
    # Of three pixels the first is missed; the others have a square's border through their centres, by a hair outside.
    fovy = frontal_fovy(height=1, pixel=PIXEL, distance=HEIGHT)
    camera = replace(EDGE_CASE.scene.camera, width=3, height=1, fovy=fovy)

    def narrow(part: float) -> Scene:
        side = PIXEL * (1 + part)
        matrix = ((side, 0.0, 0.0, PIXEL / 2), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
        return Scene(camera=camera, shapes=(Square(albedo=(0.7, 0.5, 0.3), to_world=matrix),))

    answers, missed = (ORACLE.render(narrow(part), stages_of(narrow(part))) for part in (1e-9, -1e-9))
    case = replace(CASE, scene=narrow(1e-9), least_interior=0, most_explained=0.9)
    ours = replace(candidate(rounded(missed)), items=frozenset({"CAM-4"}))

    judged = judge_case(case, [ours], [witness(answers)], ORACLE, {})

    assert answers[Stage.OBJECT][..., 0].tolist() == [[-1.0, 0.0, 0.0]]
    assert judged.outcome is Outcome.ERROR
    assert "no pixel that hits something" in judged.reason


def test_a_pixel_that_is_wrong_only_given_the_stages_before_is_in_the_ledger_and_in_the_cells():
    # The irradiance of one pixel is wrong, and the exitance right: it does not follow from its own irradiance.
    ours = rounded(truth())
    row, column = np.argwhere(ours[Stage.EXITANCE].min(axis=-1) > 0)[100]
    ours[Stage.IRRADIANCE] = put(ours[Stage.IRRADIANCE], (row, column), 1.1 * ours[Stage.IRRADIANCE][row, column])

    (check,) = (one for one in verdict(ours).checks if one.stage is Stage.EXITANCE)

    pixel = np.zeros(ours[Stage.EXITANCE].shape[:2], dtype=bool)
    pixel[row, column] = True
    assert (check.end_to_end.wrong, check.continued.wrong, check.examined.wrong) == (0, 1, 1)
    assert check.cells == cells_of(pixel)
