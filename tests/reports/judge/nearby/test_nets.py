"""A vertex on each pixel's ray: every hole of a formula that rounds shared edges twice is found, and nothing else."""

import numpy as np
import pytest

from rayproof.cases.stages import Stage
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.run.tracer_task import trace
from tests.reports.judge.nearby.scenes import netted
from tests.reports.judge.scenes import against, truth_of_scene

NET = netted()


def traced(configuration: str) -> dict:
    """Return the tracer's answers to the net."""
    answers = trace(NET, configuration).answers
    return {stage: np.asarray(image, dtype=np.float64) for stage, image in answers.answers.items() if stage in IMAGES}


IMAGES = [stage for stage in stages_of(NET) if stage is not Stage.CAMERA]


def judged(answers: dict) -> dict[Stage, np.ndarray]:
    """Return which pixels of each stage are wrong."""
    found = against(NET, answers, shadow_epsilon=1e-5)
    return {stage: pixels.wrong for stage, pixels in found.end_to_end.items()}


@pytest.mark.process
def test_the_default_formula_has_no_hole_and_no_pixel_of_it_is_failed():
    answers = traced("float32")
    over = against(NET, answers).over(Stage.OBJECT)

    assert np.count_nonzero(over) > 100
    assert not any(wrong.any() for wrong in judged(answers).values())
    assert not judged({Stage.RADIANCE: answers[Stage.RADIANCE]})[Stage.RADIANCE].any()


@pytest.mark.process
def test_every_hole_of_cramers_rule_is_found_by_stages_and_by_radiance_alone():
    answers = traced("float32/triangle=moeller_trumbore")
    truth = truth_of_scene(NET).truth
    holes = (answers[Stage.OBJECT][..., 0] != 0) & (truth[Stage.OBJECT][..., 0] == 0)

    assert np.count_nonzero(holes) > 10
    np.testing.assert_array_equal(judged(answers)[Stage.OBJECT], holes)
    np.testing.assert_array_equal(judged({Stage.RADIANCE: answers[Stage.RADIANCE]})[Stage.RADIANCE], holes)
