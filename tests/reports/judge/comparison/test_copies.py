"""A copy is told by numbers that independent roundings would not share."""

import numpy as np
import pytest

from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.copies import copied

GENERATOR = np.random.default_rng(20061115)
OURS: StageImages = {
    stage: GENERATOR.uniform(size=(12, 16, 3)) for stage in (Stage.RAY, Stage.POSITION, Stage.IRRADIANCE)
}


def test_one_copied_stage_is_enough() -> None:
    theirs = {stage: image * (1 + 2.0**-50) for stage, image in OURS.items()} | {
        Stage.IRRADIANCE: OURS[Stage.IRRADIANCE]
    }

    assert copied(OURS, theirs, OURS, both_float32=False) == (Stage.IRRADIANCE,)
    assert copied(OURS, OURS, OURS, both_float32=False) == tuple(OURS)


@pytest.mark.parametrize("factor", [1.0, 1 + 2.0**-20], ids=["rounded-rightly", "off"])
def test_a_float32_that_both_round_rightly_tells_nothing_and_a_shared_mistake_does(factor) -> None:
    single: StageImages = {
        stage: (image * factor).astype(np.float32).astype(np.float64) for stage, image in OURS.items()
    }

    assert copied(single, single, OURS, both_float32=True) == (() if factor == 1 else tuple(OURS))
    assert copied(single, single, OURS, both_float32=False) == tuple(OURS), "float64 does not end where float32 does"


@pytest.mark.parametrize("digits", [3, 4])
def test_numbers_of_few_digits_tell_nothing(digits) -> None:
    decimal: StageImages = {stage: np.round(image, digits) for stage, image in OURS.items()}
    binary: StageImages = {stage: np.round(np.ldexp(image, 3 * digits)) for stage, image in OURS.items()}

    assert copied(decimal, decimal, decimal, both_float32=False) == ()
    assert copied(binary, binary, binary, both_float32=False) == ()
