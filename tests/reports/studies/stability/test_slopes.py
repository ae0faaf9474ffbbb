"""A slope is found where there is one, with an interval that holds it, and saturated values do not bend it."""

import numpy as np
from scipy import stats

from rayproof.reports.studies.stability.climb import RESAMPLES, fitted, resampled

PARAMETERS = (1e1, 1e2, 1e3, 1e4, 1e5)


def errors(exponent: float, *, ceiling: float = np.inf) -> list[np.ndarray]:
    generator = np.random.default_rng(6)
    return [np.minimum(1e-9 * value**exponent * generator.lognormal(0, 1, 400), ceiling) for value in PARAMETERS]


def test_the_exponent_of_a_power_law_is_found() -> None:
    slope = fitted(PARAMETERS, errors(2.0), saturated=np.inf, seed=1)

    assert slope.value is not None
    assert slope.interval is not None
    assert abs(slope.value - 2.0) < 0.05
    assert slope.interval[0] <= 2.0 <= slope.interval[1]


def test_saturated_values_are_dropped() -> None:
    slope = fitted(PARAMETERS, errors(2.0, ceiling=1e-2), saturated=0.9e-2, seed=1)

    assert slope.used == PARAMETERS[:3]
    assert slope.value is not None
    assert abs(slope.value - 2.0) < 0.1


def test_two_values_are_no_slope() -> None:
    slope = fitted(PARAMETERS[:2], errors(1.0)[:2], saturated=np.inf, seed=1)

    assert slope.value is None
    assert slope.interval is None


def test_resampled_medians_are_distributed_as_those_of_a_bootstrap() -> None:
    count = 31
    error = np.arange(1.0, count + 1)

    found = 10 ** resampled(error, np.random.default_rng(8))

    for rank in (12, 14, 16, 18, 20):
        # More than half of the draws fall among the `rank` smallest.
        expected = stats.binom.sf(count // 2, count, rank / count)
        assert abs(np.mean(found <= rank + 0.5) - expected) <= 4 * np.sqrt(expected * (1 - expected) / RESAMPLES)
