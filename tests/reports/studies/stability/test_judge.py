"""A wrong slope fails, a known failure is no surprise, and one that passes is."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from rayproof.cases.ladders import Failure, Ladder, PredictedSlope, all_ladders
from rayproof.reports.studies.stability.climb import Climb, Drawn, Slope
from rayproof.reports.studies.stability.questions import ExactAnswers, Witness
from rayproof.reports.studies.stability.records import Rung
from rayproof.reports.studies.stability.survey import doubted, judged
from rayproof.tracer.formulas import FORMULAS

SPH_FAR = next(ladder for ladder in all_ladders() if ladder.name == "SPH-FAR")


def climbed(ladder: Ladder, *, broken_from: float, slope: float) -> Climb:
    """Return the climb of a formula that answers wrongly from a value on."""
    rungs = tuple(
        Rung(
            value=value,
            rays=1000,
            false_hits=0,
            false_misses=100 if value >= broken_from else 0,
            invalid=0,
            median=1e-6,
            median_low=1e-6,
            median_high=1e-6,
            p99=1e-6,
            worst=1e-6,
            scaled_error=1.0,
        )
        for value in ladder.values
    )
    fit = Slope(value=slope, interval=(slope, slope), used=ladder.values)
    return Climb(ladder=ladder, formula=FORMULAS["sphere/haines"], precision="float32", rungs=rungs, slope=fit)


def test_a_formula_that_climbs_as_predicted_passes() -> None:
    verdict = judged(climbed(SPH_FAR, broken_from=1e7, slope=1.0))

    assert (verdict.verdict, verdict.expected, verdict.surprise) == ("pass", "pass", "")
    assert verdict.breakpoint == 3e6


def test_a_wrong_slope_fails_though_errors_are_small() -> None:
    verdict = judged(climbed(SPH_FAR, broken_from=1e9, slope=1.5))

    assert verdict.verdict == "fail"
    assert "slope 1.50" in verdict.surprise


def test_an_early_break_is_a_surprise_unless_the_catalogue_knows_it() -> None:
    known = replace(SPH_FAR, fails=(Failure(formulas=("haines",), because="a test says so"),))

    assert "breaks at 1000" in judged(climbed(SPH_FAR, broken_from=1e3, slope=1.0)).surprise
    told = judged(climbed(known, broken_from=1e3, slope=1.0))
    assert (told.verdict, told.expected, told.surprise) == ("fail", "fail", "")


def test_a_known_failure_that_passes_is_a_surprise() -> None:
    known = replace(SPH_FAR, fails=(Failure(formulas=("*",), because="a test says so"),))

    verdict = judged(climbed(known, broken_from=1e9, slope=1.0))

    assert verdict.verdict == "pass"
    assert "expects it to fail: a test says so" in verdict.surprise


def test_a_known_failure_must_still_keep_its_law() -> None:
    known = replace(
        SPH_FAR,
        fails=(Failure(formulas=("*",), because="a test says so"),),
        slopes=(PredictedSlope(formulas=("*",), slope=2.0, because="squared"),),
    )

    assert "squared" in judged(climbed(known, broken_from=1e2, slope=1.0)).surprise


@pytest.mark.parametrize(("median", "law", "passes"), [(0.0, 0.0, True), (1e-9, 0.0, False), (0.0, 1.0, False)])
def test_no_error_at_all_is_a_flat_law_and_no_other(median: float, law: float, passes: bool) -> None:
    flat = replace(SPH_FAR, slopes=(PredictedSlope(formulas=("*",), slope=law, because="a test says so"),))
    climb = climbed(flat, broken_from=1e9, slope=0.0)
    none = Slope(value=None, interval=None, used=())

    verdict = judged(
        replace(climb, slope=none, rungs=tuple(structs.replace(rung, median=median) for rung in climb.rungs))
    )

    assert verdict.verdict == ("pass" if passes else "fail")
    assert ("no slope to fit" in verdict.surprise) != passes


@pytest.mark.parametrize(
    ("name", "worst", "believed"),
    [
        ("SPH-FAR", 0.0, True),
        ("SPH-FAR", 2.0**-61, True),
        ("SPH-FAR", 2.0**-59, False),
        ("SPH-FAR", float("nan"), False),
        ("TRI-EDGE", 0.0, True),
        ("TRI-EDGE", 2.0**-1000, False),
    ],
)
def test_a_truth_that_its_witness_does_not_share_is_doubted(name: str, worst: float, believed: bool) -> None:
    ladder = next(ladder for ladder in all_ladders() if ladder.name == name)
    truth = ExactAnswers(counted=np.ones(1, dtype=bool), facts={}, witness=Witness(values=1, worst=worst))
    given = Drawn(ladder=ladder, precision="float32", inputs={}, rungs=np.zeros(1), truth=truth)

    assert (doubted(given) == "") == believed
    assert believed or f"{name} in float32" in doubted(given)
