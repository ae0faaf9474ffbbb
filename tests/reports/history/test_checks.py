"""Checks of one case before and after: paired by configuration, ordered by change, numbers that are none included."""

import math
from typing import Any

import pytest

from rayproof.reports.history.run_difference import compared, decades, ours, paired, times
from rayproof.reports.results.case_records import Check
from tests.reports.checks import recorded


def check(stage: str, ratio: Any, verdict: str = "pass", configuration: str = "float32") -> Check:
    """Return a check against closed forms."""
    return recorded(configuration=configuration, reference="analytic", stage=stage, verdict=verdict, ratio=ratio)


def test_configurations_answer_to_their_names_else_to_their_places() -> None:
    assert paired(["float32", "float64"], ["float64", "float32"]) == {"float64": "float64", "float32": "float32"}
    assert paired(["float32/triangle=woop"], ["float32"]) == {"float32": "float32/triangle=woop"}
    assert paired(["float32"], ["float32", "float64"]) == {"float32": "float32"}
    # No place of one that answers to its name is given away.
    assert paired(["a", "b"], ["b", "c"]) == {"b": "b", "c": "a"}
    assert paired(["a", "b"], ["b"]) == {"b": "b"}


def test_a_changed_verdict_comes_before_any_change_of_error() -> None:
    before = {"checks": [check("ray", 0.5), check("normal", 0.02), check("distance", 0.3)]}
    after = {"checks": [check("ray", 1.5, "fail"), check("normal", 0.9), check("distance", 0.3)]}

    rows = compared(before, after, {"float32": "float32"})

    assert [(row["stage"], row["factor"]) for row in rows] == [
        ("ray", 3.0),
        ("normal", pytest.approx(45)),
        ("distance", 1.0),
    ]


def test_the_means_of_a_renamed_configuration_are_compared_too() -> None:
    before = {"checks": [check("radiance", 0.5, configuration="float32/ray=a x16")]}
    after = {"checks": [check("radiance", 0.25, configuration="float32/ray=b x16")]}

    (row,) = compared(before, after, {"float32/ray=b": "float32/ray=a"})

    assert (row["configuration"], row["factor"]) == ("float32/ray=b x16", 0.5)


def test_a_check_that_one_run_alone_made_has_no_change() -> None:
    rows = compared({"checks": [check("ray", 0.5)]}, {"checks": [check("normal", 0.5)]}, {"float32": "float32"})

    assert [(row["stage"], row["before"], row["after"], row["factor"]) for row in rows] == [
        ("normal", None, ["pass", 0.5], None),
        ("ray", ["pass", 0.5], None, None),
    ]


@pytest.mark.parametrize(
    ("before", "after", "factor"),
    [
        (0, 0, 1.0),
        (0, 2, math.inf),
        (2, 0, 0.0),
        ("inf", "inf", 1.0),
        ("inf", 2, 0.0),
        ("nan", 2, 0.0),
        (1, "nan", math.inf),
    ],
)
def test_factors_of_zero_infinity_and_nan(before: Any, after: Any, factor: float | None) -> None:
    (row,) = compared({"checks": [check("ray", before)]}, {"checks": [check("ray", after)]}, {"float32": "float32"})

    assert row["factor"] == factor


def test_errors_below_a_hundredth_of_the_limit_do_not_weigh() -> None:
    assert decades(1e-9, 1e-3) == 0
    assert decades(1e-9, 0.1) == pytest.approx(1)
    assert decades(0.1, 10) == decades(10, 0.1) == pytest.approx(2)
    assert decades(1, math.inf) == 99


def test_times_are_those_of_what_was_under_test() -> None:
    def case(seconds: float) -> dict[str, Any]:
        return {
            "checks": [check("ray", 0.1)],
            "renders": [
                {"renderer": "tracer-float32", "seconds": seconds},
                {"renderer": "analytic", "seconds": 50.0},
                {"renderer": "radiance", "seconds": 50.0},
            ],
        }

    assert ours(case(1), ["radiance"]) == ["tracer-float32"]
    assert times(case(1.0), case(3.0), (["radiance"], ["radiance"])) == [1.0, 3.0, 3.0]
    assert times({}, case(3.0), ([], ["radiance"])) == [None, 3.0, None]
