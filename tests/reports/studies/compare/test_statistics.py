"""Intervals cover what they say, and the exact test is the binomial one."""

import numpy as np
import pytest

from rayproof.reports.studies.compare.statistics import (
    mcnemar,
    median_interval,
    percentile_interval,
    shared,
)


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [(0, 0, 1.0), (5, 5, 1.0), (10, 0, 2 * 0.5**10), (0, 10, 2 * 0.5**10), (9, 1, 22 * 0.5**10)],
)
def test_mcnemar_is_the_binomial_test_of_the_pixels_where_one_errs(first: int, second: int, expected: float) -> None:
    assert mcnemar(first, second) == pytest.approx(expected)


@pytest.mark.parametrize("n", [9, 31])
def test_the_interval_of_a_median_covers_as_often_as_it_says(n: int) -> None:
    samples = np.random.default_rng(1).lognormal(size=(2000, n))

    covered = [low <= 1 <= high for low, high in (median_interval(row, level=0.95) for row in samples)]

    # Percentile intervals of medians are known to be a little short at small n.
    assert np.mean(covered) >= 0.93


def test_a_percentile_interval_is_central() -> None:
    assert percentile_interval(np.arange(101.0), level=0.9) == pytest.approx((5, 95))


def test_intervals_that_hold_together_are_each_wider() -> None:
    assert shared(0.95, 20) == pytest.approx(1 - 0.05 / 20)
    assert shared(0.95, 0) == shared(0.95, 1) == pytest.approx(0.95)

    values = np.random.default_rng(4).normal(size=31).tolist()

    alone, together = (median_interval(values, level=level) for level in (0.95, shared(0.95, 20)))

    assert together[0] < alone[0] < alone[1] < together[1]
