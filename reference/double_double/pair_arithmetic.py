"""Numbers of twice float64's digits: unevaluated sums of two floats, vectorised by Dr.Jit.

Source: Joldes, Muller and Popescu, "Tight and rigorous error bounds for basic building blocks of double-word
arithmetic", ACM Transactions on Mathematical Software 44 (2017), algorithms 6, 11 and 17: a sum errs by at most 3 u^2,
a product by 6 u^2, a quotient by 15 u^2, relative, u = 2^-53; inner products after Ogita, Rump and Oishi, "Accurate
sum and dot product", SIAM Journal on Scientific Computing 26 (2005). Knuth's two_sum and the fused two_product must be
computed as written: FastMath off, no contraction.
"""

from collections.abc import Sequence
from typing import Any

import drjit as dr

Float = Any  # drjit.llvm.Float64
Bool = Any  # drjit.llvm.Bool


def two_sum(a: Float, b: Float) -> tuple[Float, Float]:
    """Return the rounded sum and its error, exactly."""
    total = a + b
    back = total - a
    return total, (a - (total - back)) + (b - back)


def _ordered_sum(a: Float, b: Float) -> tuple[Float, Float]:
    """Return the rounded sum and its error, exactly where abs(a) >= abs(b)."""
    total = a + b
    return total, b - (total - a)


def two_product(a: Float, b: Float) -> tuple[Float, Float]:
    """Return the rounded product and its error, exactly unless it underflows."""
    product = a * b
    return product, dr.fma(a, b, -product)


class Pair:
    """high + low, where high is the sum rounded to float64."""

    __slots__ = ("high", "low")

    def __init__(self, high: Float, low: Float) -> None:
        self.high, self.low = high, low

    def __add__(self, other: "Pair") -> "Pair":
        high, error = two_sum(self.high, other.high)
        low, low_error = two_sum(self.low, other.low)
        high, error = _ordered_sum(high, error + low)
        return Pair(*_ordered_sum(high, error + low_error))

    def __neg__(self) -> "Pair":
        return Pair(-self.high, -self.low)

    def __sub__(self, other: "Pair") -> "Pair":
        return self + -other

    def __mul__(self, other: "Pair") -> "Pair":
        product, error = two_product(self.high, other.high)
        return Pair(*_ordered_sum(product, dr.fma(self.low, other.high, dr.fma(self.high, other.low, error))))

    def __truediv__(self, other: "Pair") -> "Pair":
        quotient = self.high / other.high
        product, error = two_product(quotient, other.high)
        # The subtraction is exact: the product is next to the dividend.
        rest = (self.high - product) + (self.low - dr.fma(quotient, other.low, error))
        return Pair(*_ordered_sum(quotient, rest / other.high))

    def __lt__(self, other: "Pair") -> Bool:
        return (self.high < other.high) | ((self.high == other.high) & (self.low < other.low))

    def absolute(self) -> "Pair":
        """Return the magnitude."""
        return select(self.high < 0, -self, self)

    def is_positive(self) -> Bool:
        """Return where the number is above zero; its sign is that of its high part."""
        return self.high > 0

    def is_negative(self) -> Bool:
        """Return where the number is below zero."""
        return self.high < 0

    def is_zero(self) -> Bool:
        """Return where the number is zero."""
        return self.high == 0

    def size(self) -> Float:
        """Return the magnitude, in float64."""
        return dr.abs(self.high)


def inner(products: Sequence[tuple[Pair, Pair]]) -> Pair:
    """Return a sum of products; it errs by a few u^2 of the sum of their magnitudes."""
    (first, second), *others = products
    high, error = two_product(first.high, second.high)
    low = dr.fma(first.low, second.high, dr.fma(first.high, second.low, error))
    for one, other in others:
        product, error = two_product(one.high, other.high)
        small = dr.fma(one.low, other.high, dr.fma(one.high, other.low, error))
        high, carried = two_sum(high, product)
        low += carried + small
    return Pair(*two_sum(high, low))


def sqrt(value: Pair) -> Pair:
    """Return the square root, one Newton step from float64's; of what is not positive, 0."""
    positive = value.high > 0
    root = dr.sqrt(dr.select(positive, value.high, 1))
    square, error = two_product(root, root)
    # The two terms cancel exactly: the square is next to the value.
    rest = (value.high - square) - error + value.low
    high, low = _ordered_sum(root, rest / (2 * root))
    return Pair(dr.select(positive, high, 0), dr.select(positive, low, 0))


def inverse_sqrt(value: Pair) -> Pair:
    """Return 1 / sqrt(value), one Newton step from float64's; of what is not positive, 0."""
    positive = value.high > 0
    root = 1 / dr.sqrt(dr.select(positive, value.high, 1))
    square, error = two_product(root, root)
    product, rest = two_product(value.high, square)
    # 1 - value root^2, which is small: the first difference is exact.
    rest = (1 - product) - (dr.fma(value.low, square, rest) + value.high * error)
    high, low = _ordered_sum(root, root * rest / 2)
    return Pair(dr.select(positive, high, 0), dr.select(positive, low, 0))


def select(where: Bool, one: Pair, other: Pair) -> Pair:
    """Return `one` where true, else `other`."""
    return Pair(dr.select(where, one.high, other.high), dr.select(where, one.low, other.low))


def larger(one: Pair, other: Pair) -> Pair:
    """Return the larger number."""
    return select(other < one, one, other)


def smaller(one: Pair, other: Pair) -> Pair:
    """Return the smaller number."""
    return select(one < other, one, other)
