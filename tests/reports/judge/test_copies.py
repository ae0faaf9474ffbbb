"""A copy is told by numbers that independent roundings would not share."""

import numpy as np

from cases.answers import Answers
from cases.stages import Stage
from reports.judge.copies import copied

GENERATOR = np.random.default_rng(20061115)
OURS: Answers = {stage: GENERATOR.uniform(size=(12, 16, 3)) for stage in (Stage.RAY, Stage.POSITION, Stage.IRRADIANCE)}


def test_one_copied_stage_is_enough() -> None:
    theirs = {stage: image * (1 + 2.0**-50) for stage, image in OURS.items()} | {
        Stage.IRRADIANCE: OURS[Stage.IRRADIANCE]
    }

    assert copied(OURS, theirs) == (Stage.IRRADIANCE,)
    assert copied(OURS, OURS) == tuple(OURS)


def test_few_and_simple_numbers_may_agree() -> None:
    black: Answers = {Stage.RADIANCE: np.zeros((12, 16, 3))}

    assert copied(black, black) == ()


def test_whole_numbers_and_other_sizes_are_no_copies() -> None:
    objects: Answers = {Stage.OBJECT: np.arange(200.0).reshape(10, 10, 2)}

    assert copied(objects, objects) == ()
    assert copied(OURS, {Stage.RAY: OURS[Stage.RAY][:1]}) == ()
