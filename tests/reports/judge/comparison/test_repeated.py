"""A renderer that is asked twice gives the same image: a program within the limits, others to the last bit."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.repeated import changes, repeated
from rayproof.reports.judge.scene_truth import scene_truth

ORACLE = Analytic()
SCENE = select(["primitives/sphere"])[0].scene
TRUTH = ORACLE.render(SCENE, stages_of(SCENE))
BASE = scene_truth(SCENE, stages_of(SCENE), ORACLE, known=TRUTH)
FIRST = Answers(name="exec", precision="float32", answers=TRUTH)
MIDDLE = np.s_[SCENE.camera.height // 2, SCENE.camera.width // 2, 1]


def spoiled(stage: Stage, value: float | None = None, *, factor: float = 1.0) -> Answers:
    image = np.array(TRUTH[stage])
    image[MIDDLE] = image[MIDDLE] * factor if value is None else value
    return replace(FIRST, answers={**TRUTH, stage: image})


def test_the_same_image_passes_and_one_bit_does_not() -> None:
    last_bit = spoiled(Stage.RADIANCE, float(np.nextafter(TRUTH[Stage.RADIANCE][MIDDLE], np.inf)))

    again = repeated("a/case", FIRST, replace(FIRST, answers=dict(TRUTH)), BASE, varies=False)
    found = repeated("a/case", FIRST, last_bit, BASE, varies=False)

    assert again["verdict"] == "pass"
    assert (found["verdict"], found["stage"], found["differing"]) == ("fail", "radiance", 1)
    assert found["pixel"] == [MIDDLE[1], MIDDLE[0]]
    assert "a/case differently when it is asked again: 1 of" in found["sentence"]
    assert "beyond" not in found["sentence"]


@pytest.mark.parametrize(("factor", "verdict", "words"), [(1 + 1e-7, "pass", "repeats to"), (1.1, "fail", "the limit")])
def test_a_program_may_vary_within_the_limits(factor: float, verdict: str, words: str) -> None:
    found = repeated("a/case", FIRST, spoiled(Stage.RADIANCE, factor=factor), BASE, varies=True)

    assert found["verdict"] == verdict
    assert (found["beyond"] > 1) == (verdict == "fail")
    assert words in found["sentence"]


def test_a_millionth_of_the_brightest_value_is_no_difference_even_where_the_image_is_dark() -> None:
    row, column = np.argwhere((TRUTH[Stage.RADIANCE] == 0).all(axis=-1))[0]
    dim, bright = (np.array(TRUTH[Stage.RADIANCE]) for _ in range(2))
    dim[row, column], bright[row, column] = (share * dim.max() for share in (1e-6, 1e-5))

    verdicts = [
        repeated("a/case", FIRST, replace(FIRST, answers={**TRUTH, Stage.RADIANCE: image}), BASE, varies=True)[
            "verdict"
        ]
        for image in (dim, bright)
    ]

    assert verdicts == ["pass", "fail"]


def test_a_sign_of_zero_counts_and_one_nan_is_as_good_as_another() -> None:
    zero, minus, none = (spoiled(Stage.NORMAL, value).answers or {} for value in (0.0, -0.0, np.nan))

    assert list(changes(zero, minus)) == [Stage.NORMAL]
    assert not changes(none, spoiled(Stage.NORMAL, np.nan).answers or {})


def test_a_stage_that_is_missing_the_second_time_differs_and_so_does_an_error() -> None:
    less = replace(FIRST, answers={stage: image for stage, image in TRUTH.items() if stage is not Stage.NORMAL})
    lost = replace(FIRST, error="it was ended by SIGSEGV")

    assert repeated("a/case", FIRST, less, BASE, varies=True)["verdict"] == "fail"
    assert "SIGSEGV" in repeated("a/case", FIRST, lost, BASE, varies=False)["sentence"]
