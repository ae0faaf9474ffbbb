"""Pairs of floats against exact fractions: errors as proved in the source, and the guards that this rests on."""

import operator
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import drjit as dr
import numpy as np
import pytest
from drjit.llvm import Float64

from rayproof.reference.double_double.arithmetic import (
    PI,
    Pair,
    fast_math_off,
    inner,
    inverse_sqrt,
    root,
    sqrt,
    tangent,
    two_product,
    two_sum,
    unit,
)

COUNT = 400
U = Fraction(1, 2**53)


def numbers(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return high and low parts of numbers of either sign and of very different sizes."""
    generator = np.random.default_rng(seed)
    high = generator.choice((-1, 1), COUNT) * 2.0 ** generator.uniform(-60, 60, COUNT)
    return high, high * generator.uniform(-1, 1, COUNT) * 2.0**-54


def exact(value: Any) -> list[Fraction]:
    dr.eval(value.high, value.low)
    pairs = zip(np.asarray(value.high).tolist(), np.asarray(value.low).tolist(), strict=True)
    return [Fraction(high) + Fraction(low) for high, low in pairs]


def pair(seed: int) -> Pair:
    high, low = numbers(seed)
    return Pair(Float64(high), Float64(low))


@pytest.mark.parametrize(
    ("operation", "bound"),
    [
        pytest.param(operator.add, 3, id="sum"),
        pytest.param(operator.sub, 3, id="difference"),
        pytest.param(operator.mul, 6, id="product"),
        pytest.param(operator.truediv, 16, id="quotient"),
    ],
)
def test_operations_err_by_a_few_squares_of_the_unit_roundoff(operation: Callable[..., Any], bound: int) -> None:
    with fast_math_off():
        one, other = pair(1), pair(2)
        found = exact(operation(one, other))

    for value, a, b in zip(found, exact(one), exact(other), strict=True):
        truth = operation(a, b)
        assert abs(value - truth) <= bound * U * U * abs(truth) * (1 + 10 * U)


def test_square_roots_and_their_inverses() -> None:
    with fast_math_off():
        value = pair(3) * pair(3)
        roots, inverses = exact(sqrt(value)), exact(inverse_sqrt(value))

    for found, inverse, truth in zip(roots, inverses, exact(value), strict=True):
        assert abs(found * found - truth) <= 32 * U * U * truth
        assert abs(inverse * inverse * truth - 1) <= 32 * U * U


def test_inner_products_err_by_little_of_their_terms_even_where_they_cancel() -> None:
    with fast_math_off():
        a, b, c, d = (pair(seed) for seed in (4, 5, 6, 7))
        minus = Pair(-(a * b).high, -(a * b).low)
        one = Pair(Float64(1), Float64(0))
        found = exact(inner([(a, b), (minus, one), (c, d)]))
        rest = exact(minus)

    for value, p, q, r, s, t in zip(found, exact(a), exact(b), rest, exact(c), exact(d), strict=True):
        assert abs(value - (p * q + r + s * t)) <= 16 * U * U * (abs(p * q) + abs(r) + abs(s * t))


def test_the_building_blocks_lose_nothing() -> None:
    a, b = numbers(8)[0], numbers(9)[0]
    with fast_math_off():
        results = two_sum(Float64(a), Float64(b)), two_product(Float64(a), Float64(b))
        dr.eval(results)

    for (high, low), operation in zip(results, (operator.add, operator.mul), strict=True):
        for x, y, h, l in zip(a.tolist(), b.tolist(), np.asarray(high), np.asarray(low), strict=True):  # noqa: E741
            assert Fraction(h) + Fraction(l) == operation(Fraction(x), Fraction(y))


def test_constants_have_sixty_digits() -> None:
    assert abs(
        PI - Fraction("3.14159265358979323846264338327950288419716939937510582097494459230781640629")
    ) < Fraction(1, 10**70)
    for square in (Fraction(2), Fraction(1, 10**40), Fraction(10) ** 41 + 1):
        assert abs(root(square) ** 2 / square - 1) < Fraction(1, 10**55)
    assert tangent(Fraction(45)) == pytest.approx(1, abs=1e-55)
    # tan 15 = 2 - sqrt 3, tan 60 = sqrt 3, tan 89.9 by tan(a + b).
    assert abs(2 - tangent(Fraction(15)) - tangent(Fraction(60))) < Fraction(1, 10**50)
    steep, step = tangent(Fraction(899, 10)), tangent(Fraction(1, 10))
    assert abs(steep * step - 1) < Fraction(1, 10**50)
    assert sum(part * part for part in unit((Fraction(1), Fraction(2), Fraction(-5)))) == pytest.approx(1, abs=1e-55)
