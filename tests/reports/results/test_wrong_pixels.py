"""The size of a mistake in words: pixels and their mean error, never a quotient with a limit of nothing."""

from typing import Any

import pytest

from rayproof.reports.results.wrong_pixels import wrong_pixels
from tests.reports.checks import recorded

FAILS = {"verdict": "fail", "stage": "irradiance", "configuration": "float32", "reference": "radiance", "ratio": "inf"}


def case(*checks: dict[str, Any], verdict: str = "fail", **more: Any) -> Any:
    """Return a case's record with checks by their keys in results.json."""
    return {"verdict": verdict, "stage": checks[0]["stage"], "checks": [recorded(**check) for check in checks], **more}


@pytest.mark.parametrize(
    ("check", "words"),
    [
        (
            {"examined": {"pixels": 5120, "wrong": 1912}, "end_to_end": {"worst_ratio": "inf", "mean_wrong": 0.3274}},
            "1,912 of 5,120 pixels wrong at irradiance, by 0.327 W/m^2 on average",
        ),
        (
            {"examined": {"pixels": 5120, "wrong": 1}, "end_to_end": {"worst_ratio": 3e47, "worst_error": 0.5}},
            "1 of 5,120 pixels wrong at irradiance, by 0.5 W/m^2",
        ),
        (
            {"examined": {"pixels": 64, "wrong": 64}, "end_to_end": {"worst_error": "nan", "nan": 64}},
            "64 of 64 pixels wrong at irradiance, 64 without a finite number",
        ),
        (
            {"stage": "object", "examined": {"pixels": 64, "wrong": 2}, "end_to_end": {"mean_wrong": 3.0}},
            "2 of 64 pixels wrong at object",
        ),
        ({"stage": "camera", "examined": {"pixels": 32, "wrong": 5}}, "5 of 32 entries wrong at camera"),
        ({"examined": {"pixels": 64}}, ""),
        ({}, ""),
    ],
)
def test_the_number_of_wrong_pixels_and_their_mean_error_are_named(check: dict[str, Any], words: str) -> None:
    assert wrong_pixels(case(FAILS | check)) == words


def test_of_several_checks_the_one_with_the_most_wrong_pixels_decides() -> None:
    few, many = ({"examined": {"pixels": 64, "wrong": wrong}} for wrong in (1, 60))

    assert wrong_pixels(case(FAILS | few, FAILS | many)).startswith("60 of 64")
    assert wrong_pixels(case(FAILS | many, verdict="pass")) == ""
