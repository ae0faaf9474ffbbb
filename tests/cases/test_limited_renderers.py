"""What the suite is not blind to: renderers with a limit that one case, and no other, is beyond."""

import numpy as np
import pytest

import rayproof
from rayproof.cases.case import Case
from rayproof.cases.families import select
from tests.cases.limited_renderers import LIMITED, right

CASES = {case.name: case for case in select(["extremes"])}


def failed_stages(case: Case, images: dict[str, np.ndarray]) -> set[str]:
    """Return the stages of which a check fails."""
    with np.errstate(invalid="ignore"):  # of a miss, whose distance is infinite, where the oracle's ray is in a plane
        judgement = rayproof.judge(case, rounded(images))
    return {str(check["stage"]) for check in judgement.checks if check["verdict"] == "fail"}


def rounded(images: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return images as float32 numbers: an image of the oracle itself is no image of a subject."""
    return {stage: image.astype(np.float32) for stage, image in images.items()}


def test_every_case_is_there_for_a_renderer() -> None:
    assert {case for _, case, _ in LIMITED.values()} == {*CASES}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_the_right_images_of_the_cases_pass(case: Case) -> None:
    assert rayproof.judge(case, rounded(right(case.scene, ["object", "visibility", "radiance"]))).verdict == "pass"


@pytest.mark.parametrize("name", LIMITED)
def test_a_limit_fails_by_radiance_alone_and_by_stages(name: str) -> None:
    renderer, case, wrong = LIMITED[name]
    images = renderer(CASES[case].scene, wrong)

    assert failed_stages(CASES[case], images) == {*wrong}
    if "radiance" in wrong:
        assert failed_stages(CASES[case], {"radiance": images["radiance"]}) == {"radiance"}
