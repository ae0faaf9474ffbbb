"""Steps: found where they are, not found in noise."""

import numpy as np
import pytest

from rayproof.reports.history.database import changes, steps


def test_two_unequal_values_of_equal_code_are_a_step() -> None:
    (step,) = changes([0.3, 0.3, 0.6], least=1.1)

    assert step.at == 2
    assert step.factor == pytest.approx(2)


def test_the_last_bit_is_no_step() -> None:
    assert changes([0.3, 0.3000001, 0.3, 0.3000002], least=1.1) == []


@pytest.mark.parametrize("length", [0, 1])
def test_nothing_and_one_value_have_no_step(length: int) -> None:
    assert steps([0.5] * length, least=1.1) == changes([0.5] * length, least=1.1) == []


def test_steps_up_and_down_are_found_in_noise() -> None:
    random = np.random.default_rng(3)
    level = np.repeat([1.0, 1.5, 0.9], 12)

    found = steps((level * np.exp(0.03 * random.normal(size=36))).tolist(), least=1.2)

    assert [step.at for step in found] == [12, 24]
    assert found[0].factor == pytest.approx(1.5, rel=0.05)


def test_noise_alone_makes_no_step() -> None:
    random = np.random.default_rng(4)
    series = np.exp(0.1 * random.normal(size=(50, 20)))

    flagged = [steps(one.tolist(), least=1.2) for one in series]

    # Schwarz' criterion is consistent, not exact: a few of fifty series of pure noise may be split.
    assert sum(map(bool, flagged)) <= 5


def test_one_slow_run_is_no_step() -> None:
    series = [1.0, 1.01, 0.99, 1.0, 5.0, 1.02, 1.0, 0.98]

    assert steps(series, least=1.2) == []
