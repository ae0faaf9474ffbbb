"""What a whole run shares shows at one part in a million, and rounding in whatever order does not."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rayproof.cases.scene import PointLight, Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison import Comparison
from rayproof.reports.judge.forward.common_factors import LEAST_DISTINCT, bias
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.scene_truth import scene_truth
from rayproof.reports.results.case_records import Bias, Check
from rayproof.reports.results.headline import headline
from rayproof.reports.run.pooled_factors import common_factors, wrong
from tests.reports.judge.comparison.test_common_factors import FOLDS, ORDERS, float32_program
from tests.reports.judge.scenes import BALL, CAMERA, FLOOR, ORACLE, candidate, witness

VIEWS = 64  # as many different cameras and lights as the default suite has
RANDOM = np.random.default_rng(20)


def views() -> Iterator[Scene]:
    """Yield small scenes of as many cameras and lights."""
    for _ in range(VIEWS):
        turn, height = RANDOM.uniform(0, 2 * np.pi), RANDOM.uniform(1.5, 3.5)
        camera = replace(CAMERA, eye=(4 * np.cos(turn), 4 * np.sin(turn), height), width=28, height=21)
        place = (*RANDOM.uniform(-1.5, 1.5, 2), RANDOM.uniform(3, 5))
        light = PointLight(position=place, flux=tuple(RANDOM.uniform(50, 150, 3)))
        ball = replace(BALL, albedo=tuple(RANDOM.uniform(0.2, 0.9, 3)))
        yield Scene(camera=camera, shapes=(ball, FLOOR), lights=(light,))


@cache
def rendered() -> list[tuple[Comparison, np.ndarray]]:
    """Return for each view a correct program's radiance alone, in float32, with the terms on which it is judged."""
    found = []
    orders = [(order, fold) for order in ORDERS for fold in FOLDS]
    for number, scene in enumerate(views()):
        truth = ORACLE.render(scene, stages_of(scene))
        image = float32_program(scene, *orders[number % len(orders)])[Stage.RADIANCE]
        ours = replace(candidate({Stage.RADIANCE: image}), chained=False)
        base = scene_truth(scene, stages_of(scene), ORACLE, known=truth)
        found.append((Comparison(base=base, subject=ours, reference=witness(truth)), image))
    return found


def records(factor: float) -> list[dict]:
    """Return the cases' records of a program whose float32 radiance has a factor."""
    found = []
    for number, (pair, image) in enumerate(rendered()):
        ours = (image.astype(np.float32) * np.float64(factor)).astype(np.float32).astype(np.float64)
        measured = bias(pair, Stage.RADIANCE, ours, None)
        assert measured.ratio < 1, "no group of its own shows it"
        check = Check(configuration="exec", stage=Stage.RADIANCE, bias=measured.recorded())
        found.append({"name": f"test/{number}", "camera_and_lights": str(number), "checks": [check]})
    return found


@pytest.mark.parametrize("factor", [1 + 1e-6, 1 - 1e-6, 1 + 2e-6])
def test_a_millionth_that_a_run_shares_shows_in_radiance_alone(factor):
    (pooled,) = common_factors(records(factor))
    (sentence,) = wrong([pooled], [])

    assert pooled["verdict"] == "fail"
    assert pooled["voices"] == pooled["cases"] == VIEWS
    assert sentence.startswith(f"radiance of exec is {1 + pooled['off']:.9g} times what it should be in the whole run")


def test_correct_programs_in_any_order_share_no_factor():
    (pooled,) = common_factors(records(1.0))

    assert pooled["verdict"] == "pass"
    assert abs(pooled["off"]) < pooled["sees"] < 1e-6
    assert wrong([pooled], []) == []


def said(off: float, number: int, *, stage: str = "radiance", view: str | None = None) -> dict:
    """Return a case's record that says only how far its middle factor is off."""
    bias = Bias(common=off, allowance=5e-7, ratio=0.5, sees=1e-6)
    check = Check(configuration="exec", stage=Stage(stage), bias=bias)
    return {"name": f"test/{number}", "camera_and_lights": view or str(number), "checks": [check]}


def test_cases_of_one_camera_and_light_have_one_voice_and_few_voices_decide_nothing():
    crowd = [said(1e-5, number, view="the same") for number in range(200)]
    few = [said(1e-5, number) for number in range(LEAST_DISTINCT - 1)]
    enough = [said(1e-5, number) for number in range(LEAST_DISTINCT)]

    assert [(one["voices"], one["sees"], one["verdict"]) for one in common_factors(crowd)] == [(1, None, "undecided")]
    assert [one["verdict"] for one in common_factors(few)] == ["undecided"]
    assert [one["verdict"] for one in common_factors(enough)] == ["fail"]


def test_a_few_cases_that_are_far_off_are_no_factor_of_the_run():
    mixed = [said(1e-5 if number % 5 == 0 else 0.0, number) for number in range(60)]

    assert [one["verdict"] for one in common_factors(mixed)] == ["pass"]


def test_the_run_is_blamed_at_the_first_stage_that_has_the_factor_and_says_so_in_its_headline():
    stages = ("irradiance", "exitance", "radiance")
    pooled = common_factors([said(1e-5, number, stage=stage) for number in range(40) for stage in stages])
    counts = dict.fromkeys(("warn", "undecided", "unsupported", "missing", "reference_suspect", "error", "fail"), 0) | {
        "planned": 40,
        "pass": 40,
    }

    text = headline({"summary": counts, "checks": counts, "cases": [], "wrong_factors": wrong(pooled, [])})

    assert [entry["stage"] for entry in pooled] == list(stages), "in the order of the light path"
    assert text.startswith("40 cases: each passes, in 40 checks; but irradiance of exec is 1.00001 times")
    assert "radiance of exec" not in text.replace("irradiance of exec", "")
