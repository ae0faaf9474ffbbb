"""Random scenes in which somebody who was right stood accused, and what became of the accusation."""

import pytest

from rayproof.cases.random_scenes import random_case
from rayproof.reference import REFERENCES
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.case import judge_case
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.tracer_task import trace
from rayproof.reports.run.worker_tasks import ask_reference

SCENES = {
    # Under grazing light, next to its own edge, a cube's next face hides the light from who has triangles instead.
    109: "a cube of triangles",
    # As far away as the eye is from the origin all who round rightly find the same position.
    128: "a copy that was none",
    # Baked to float32 the tiny triangle lies in another plane than its normal says.
    147: "a normal off its plane",
}


@pytest.mark.process
@pytest.mark.references
@pytest.mark.parametrize("number", SCENES, ids=SCENES.get)
def test_nobody_is_accused_of_what_the_scene_itself_leaves_open(number):
    case = random_case(1, number)
    candidate = trace(case.scene, "float64").answers
    # Radiance's light is a ball that is larger than the other scenes, and dark inside.
    names = ("analytic", "radiance") if number == 109 else ("analytic",)
    witnesses = [ask_reference(name, REFERENCES[name](), case.scene, independent=True) for name in names]

    judged = judge_case(case, [candidate], witnesses, Analytic(), {})

    assert judged.outcome is Outcome.PASS, judged.reason
