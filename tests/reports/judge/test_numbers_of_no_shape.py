"""A renderer that names a shape or a face that the scene has not is wrong; it does not bring the judge down."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.scene import Mesh
from rayproof.cases.stages import Stage
from rayproof.reports.judge.case import adjudication, judge_case
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.results.outcomes import Outcome
from tests.reports.judge.scenes import CASE, FLOOR, ORACLE, SCENE, candidate, rounded, witness

TENT = Mesh(
    albedo=(0.9, 0.2, 0.4),
    vertices=np.array([[-0.9, -0.9, 0.0], [0.9, -0.9, 0.1], [0.9, 0.9, 0.0], [-0.9, 0.9, 0.2], [0.1, 0.0, 1.0]]),
    faces=np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]),
    two_sided=True,
)
PITCHED = replace(CASE, scene=replace(SCENE, shapes=(TENT, FLOOR)))
NUMBERS = (np.nan, np.inf, 99.0, -5.0)


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("channel", [0, 1], ids=["shape", "face"])
@pytest.mark.parametrize("case", [CASE, PITCHED], ids=["ball", "mesh"])
@pytest.mark.parametrize("everywhere", [False, True], ids=["one pixel", "all"])
@pytest.mark.parametrize("chained", [True, False], ids=["chained", "of its own passes"])
def test_an_object_that_the_scene_has_not_is_a_wrong_object(case: Case, channel, number, everywhere, chained):
    truth = ORACLE.render(case.scene, stages_of(case.scene))
    ours = rounded(truth)
    middle = case.scene.camera.height // 2, case.scene.camera.width // 2
    ours[Stage.OBJECT][... if everywhere else middle][..., channel] = number
    parties = [replace(candidate(ours), chained=chained)], [witness(truth)]

    judged = judge_case(case, *parties, ORACLE, {})

    assert truth[Stage.OBJECT][(*middle, 0)] == 0
    assert (judged.outcome, judged.stage) == (Outcome.FAIL, Stage.OBJECT)
    assert len(judged.checks) == judged.planned
    assert adjudication(judged, parties[0], ORACLE)["object"]["ratio"][0][1] == "inf"
