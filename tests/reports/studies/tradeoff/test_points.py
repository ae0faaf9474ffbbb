"""The front holds what nothing beats, and only that."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rayproof.reports.studies.tradeoff.points import TradeoffPoint, front, root_mean_square

POINT = TradeoffPoint(
    diagram="sphere/far",
    label="a",
    renderer="tracer",
    variant="a",
    precision="float32",
    samples=1,
    kind="right",
    clock="kernels",
    error=1.0,
    error_interval=(0.9, 1.1),
    natural=1e-6,
    unit="m",
    wrong=0.0,
    nanoseconds=1.0,
    nanoseconds_interval=(0.9, 1.1),
)


def named(points: list[TradeoffPoint]) -> list[str]:
    return [point.label for point in front(points)]


def test_slower_and_less_accurate_is_not_on_the_front() -> None:
    nearer = replace(POINT, label="b", nanoseconds=2.0, error=0.1)
    beaten = replace(POINT, label="c", nanoseconds=3.0, error=0.5)

    assert named([beaten, nearer, POINT]) == ["a", "b"]


@pytest.mark.parametrize(
    "other",
    [
        pytest.param(replace(POINT, label="b", nanoseconds=2.0, error=0.999), id="no-gain-worth-the-time"),
        pytest.param(replace(POINT, label="b", nanoseconds=0.5, kind="control"), id="known-to-be-wrong"),
        pytest.param(replace(POINT, label="b", nanoseconds=0.5, error=math.nan), id="without-an-error"),
    ],
)
def test_what_buys_no_place(other: TradeoffPoint) -> None:
    assert named([POINT, other]) == ["a"]


def test_more_wrong_pixels_beat_nothing() -> None:
    reckless = replace(POINT, label="b", nanoseconds=0.5, wrong=0.001)

    assert named([POINT, reckless]) == ["b", "a"]


def test_a_formula_that_decides_too_much_wrongly_is_not_on_the_front_however_fast() -> None:
    # The textbook's form a thousand radii away was the fastest of its front with 5 % of the pixels wrong.
    wrong = replace(POINT, label="b", nanoseconds=0.5, wrong=0.0011)

    assert named([POINT, wrong]) == ["a"]


def test_the_root_mean_square_is_over_the_mean_of_the_truth() -> None:
    truth = np.full((8, 8, 3), 2.0)

    error, (low, high) = root_mean_square(truth + 0.5, truth)

    assert error == low == high == 0.25
