"""Pairs keep a hundred bits, and their bound holds."""

import operator
from fractions import Fraction

import numpy as np
import pytest

from rayproof.reports.studies.stability.arithmetic import BoundedPair


def exact(pair: BoundedPair, index: int) -> Fraction:
    return Fraction(float(pair.high[index])) + Fraction(float(np.broadcast_to(pair.low, pair.high.shape)[index]))


@pytest.mark.parametrize("operation", [operator.add, operator.sub, operator.mul, operator.truediv])
def test_an_operation_stays_within_its_bound(operation) -> None:
    generator = np.random.default_rng(3)
    a, b = generator.normal(size=(2, 200)) * 10.0 ** generator.integers(-20, 20, (2, 200))

    found = operation(BoundedPair(a) / 3, BoundedPair(b) / 7)

    for i in range(200):
        true = operation(Fraction(a[i]) / 3, Fraction(b[i]) / 7)
        assert abs(exact(found, i) - true) <= Fraction(float(found.error[i]))
        assert found.error[i] <= 2.0**-90 * max(abs(a[i]), abs(b[i]), abs(float(true)))


def test_a_square_root_squares_back() -> None:
    values = np.random.default_rng(4).uniform(1e-30, 1e30, 200)

    root = BoundedPair(values).sqrt()

    np.testing.assert_array_less(abs((root * root - BoundedPair(values)).high), 2.0**-98 * values)


def test_a_sign_in_doubt_is_not_told() -> None:
    third = BoundedPair(np.array([1.0])) / 3

    assert np.isnan((third * 3 - 1).sign())
    assert (third * 3 - 0.5).sign() == 1
