"""An image of another size, with other channels or a camera of other parts is its maker's fault, whoever that is."""

import numpy as np
import pytest

from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import adjudication, judge_case
from rayproof.reports.judge.verdict import Judged
from rayproof.reports.results.outcomes import Outcome
from tests.reports.judge.scenes import CASE, ORACLE, candidate, rounded, truth, witness

SPOILT = {
    "a row": lambda image: image[:1],
    "a channel more": lambda image: np.concatenate([image, image[..., :1]], axis=-1),
    "no channels": lambda image: image[..., 0],
}
PARTS = ("view", "view_inverse", "projection", "projection_inverse", "frustum_corners", "ndc", "pixel")


def judged(ours: dict, theirs: dict) -> tuple[Judged, list[Answers], list[Answers]]:
    """Judge answers before the oracle and a third that answers `theirs`, and sum up the panel too."""
    parties = [candidate(ours)], [witness(truth()), witness(theirs, name="third")]
    found = judge_case(CASE, *parties, ORACLE, {})
    adjudication(found, parties[0], ORACLE)
    assert len(found.checks) == found.planned
    return found, *parties


@pytest.mark.parametrize("how", SPOILT)
@pytest.mark.parametrize("stage", IMAGE_STAGES, ids=str)
def test_of_the_one_under_test_it_is_a_failure(stage, how):
    ours = rounded(truth())
    ours[stage] = SPOILT[how](ours[stage])

    found = judged(ours, truth())[0]

    assert (found.outcome, found.stage) == (Outcome.FAIL, stage)
    assert "shape" in found.reason


@pytest.mark.parametrize("how", SPOILT)
@pytest.mark.parametrize("stage", IMAGE_STAGES, ids=str)
def test_of_a_reference_it_makes_that_suspect_and_nobody_else(stage, how):
    theirs = truth()
    theirs[stage] = SPOILT[how](theirs[stage])

    found = judged(rounded(truth()), theirs)[0]

    suspects = [(check.reference, check.stage) for check in found.checks if check.outcome is not Outcome.PASS]
    assert suspects == [("third", stage)]
    assert (found.outcome, found.stage) == (Outcome.REFERENCE_SUSPECT, stage)
    assert "third" in found.reason


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("how", ["missing", "cut"])
def test_of_a_camera_a_part_that_is_not_there_is_its_makers_fault(part, how):
    answers = truth()
    camera = dict(answers[Stage.CAMERA])
    if how == "missing":
        del camera[part]
    else:
        camera[part] = camera[part][:1]
    broken = answers | {Stage.CAMERA: camera}

    ours, theirs = (judged(*pair)[0] for pair in ((rounded(broken), answers), (rounded(answers), broken)))

    assert (ours.outcome, ours.stage) == (Outcome.FAIL, Stage.CAMERA)
    assert (theirs.outcome, theirs.stage) == (Outcome.REFERENCE_SUSPECT, Stage.CAMERA)
    assert part in theirs.reason


def test_an_oracle_that_falls_is_no_failure_of_the_one_under_test():
    class Falling(type(ORACLE)):
        def continue_from(self, scene, stage, earlier):
            raise ValueError("operands could not be broadcast together")

    with pytest.raises(ValueError, match="could not be broadcast"):
        judge_case(CASE, [candidate(rounded(truth()))], [witness(truth())], Falling(), {})
