"""What a renderer says that it does not see is excused, and there must be enough that it says it sees."""

from dataclasses import replace

import numpy as np
import pytest

from cases.stages import Stage
from reports.judge.judging import judge_case
from reports.judge.outcomes import Outcome
from tests.reports.judge.scenes import CASE, ORACLE, candidate, rounded, truth, witness

FAR_ABOVE_ALL = 1e9  # m


@pytest.mark.parametrize("epsilon", ["ray_epsilon", "shadow_epsilon"])
@pytest.mark.parametrize("least", [0, CASE.least_interior])
def test_an_epsilon_that_swallows_the_image_passes_nothing(epsilon, least):
    answers = rounded(truth())
    wrong = answers | {stage: 3 * answers[stage] for stage in (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)}
    case = replace(CASE, least_interior=least)

    for ours in (answers, wrong):
        blind = replace(candidate(ours), chained=False, **{epsilon: FAR_ABOVE_ALL})
        found = judge_case(case, [blind], [witness(truth())], ORACLE, {})

        assert found.outcome in (Outcome.ERROR, Outcome.FAIL)
        assert found.outcome is Outcome.ERROR or ours is wrong


def test_an_epsilon_below_what_is_seen_costs_nothing():
    near = replace(candidate(rounded(truth())), ray_epsilon=1e-3)

    assert judge_case(CASE, [near], [witness(truth())], ORACLE, {}).outcome is Outcome.PASS


def test_what_is_missed_before_the_eye_counts_against_the_edge_that_a_case_allows():
    answers = truth()
    distances = answers[Stage.DISTANCE][answers[Stage.OBJECT][..., 0] == 0]
    some = replace(candidate(rounded(answers)), ray_epsilon=float(np.median(distances)))

    found = judge_case(replace(CASE, least_interior=0), [some], [witness(answers)], ORACLE, {})

    assert found.outcome is Outcome.ERROR
    assert f"the case allows {CASE.most_edge}" in found.reason
