"""Arrays of numbers of 100 bits with error radii: high + low in float64, and the exact value no farther than `radius`.

Source: Dekker, "A floating-point technique for extending the available precision", Numerische Mathematik 18 (1971);
Joldes, Muller and Popescu, "Tight and rigorous error bounds for basic building blocks of double-word arithmetic", ACM
Transactions on Mathematical Software 44 (2017), whose bounds are at most 2^-101.9 for sums of equal signs, products and
quotients. The radii here allow more. NaN in a radius fails every comparison that would accept the number.
"""

from typing import Any

import numpy as np

SUM = 2.0**-102  # of the summands' magnitudes
PRODUCT = 2.0**-100
QUOTIENT = 2.0**-98
ROOT = 2.0**-98
SAFE = 1 + 2.0**-45  # covers the roundings of a radius
TINY = 1e-290  # covers products and their tails that underflow
SPLIT = 134217729.0  # 2^27 + 1


class Bundle:
    """One number per pixel, or one for all. Whole numbers and exact zeros may stand in for bundles everywhere."""

    __slots__ = ("high", "low", "radius")

    def __init__(self, high: Any, low: Any, radius: Any) -> None:
        self.high, self.low, self.radius = high, low, radius

    def __neg__(self) -> "Bundle":
        return Bundle(-self.high, -self.low, self.radius)

    def __add__(self, other: "Bundle | int") -> "Bundle":
        if isinstance(other, int):
            if other == 0:
                return self
            other = whole(other)
        total, rest = _two_sum(self.high, other.high)
        high, low = _two_sum(total, rest + (self.low + other.low))
        size = np.abs(self.high) + np.abs(other.high)
        return Bundle(high, low, (self.radius + other.radius + size * SUM) * SAFE)

    __radd__ = __add__

    def __sub__(self, other: "Bundle | int") -> "Bundle":
        return self + -other

    def __rsub__(self, other: int) -> "Bundle":
        return -self + other

    def __mul__(self, other: "Bundle | int") -> Any:
        if isinstance(other, int):
            if other == 0:
                return 0
            if other == 1:
                return self
            other = whole(other)
        product, rest = _two_product(self.high, other.high)
        rest = rest + (self.high * other.low + self.low * other.high)
        high, low = _fast_two_sum(product, rest)
        size, other_size = np.abs(self.high), np.abs(other.high)
        spread = size * other.radius + self.radius * (other_size + other.radius)
        # The halves of a pair's size are off by 2^-53 of it, which SAFE covers.
        return Bundle(high, low, (spread + np.abs(high) * PRODUCT) * SAFE + TINY)

    __rmul__ = __mul__

    def __truediv__(self, other: "Bundle | int") -> "Bundle":
        if isinstance(other, int):
            other = whole(other)
        first = self.high / other.high
        product, rest = _two_product(first, other.high)
        remainder = ((self.high - product) - rest) + (self.low - first * other.low)
        high, low = _fast_two_sum(first, remainder / other.high)
        size = np.abs(other.high)
        spread = (self.radius + np.abs(high) * other.radius + TINY) / (size - other.radius)
        radius = (spread + np.abs(high) * QUOTIENT) * SAFE + TINY
        return Bundle(high, low, np.where(size > 2 * other.radius, radius, np.inf))

    def __rtruediv__(self, other: int) -> Any:
        return 0 if other == 0 else whole(other) / self

    def sqrt(self) -> "Bundle":
        """Return the square root; of what may be zero or less nothing is known."""
        first = np.sqrt(self.high)
        product, rest = _two_product(first, first)
        remainder = ((self.high - product) - rest) + self.low
        high, low = _fast_two_sum(first, remainder / (2 * first))
        # |sqrt(a + r) - sqrt(a)| <= r / sqrt(a), for r at most half of a.
        radius = ((self.radius + TINY) / first + first * ROOT) * SAFE
        return Bundle(high, low, np.where(self.high > 2 * self.radius, radius, np.inf))

    def rsqrt(self) -> "Bundle":
        """Return 1 over the square root."""
        return 1 / self.sqrt()

    def __getitem__(self, index: Any) -> "Bundle":
        return Bundle(self.high[index], self.low[index], self.radius[index])


def whole(value: int) -> Bundle:
    """Return a small whole number."""
    return Bundle(np.float64(value), np.float64(0), np.float64(0))


def larger(one: Any, other: Any, *, sign: int) -> Bundle:
    """Return the larger of two, or the smaller for `sign` -1: the extreme of the middles, and the larger radius."""
    one, other = (whole(value) if isinstance(value, int) else value for value in (one, other))
    ahead = np.where(one.high == other.high, sign * (one.low - other.low), sign * (one.high - other.high)) > 0
    return Bundle(
        np.where(ahead, one.high, other.high),
        np.where(ahead, one.low, other.low),
        np.maximum(one.radius, other.radius),
    )


def _two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    total = a + b
    shifted = total - a
    return total, (a - (total - shifted)) + (b - shifted)


def _fast_two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """Return the sum and its rounding error; |a| >= |b|."""
    total = a + b
    return total, b - (total - a)


def _two_product(a: Any, b: Any) -> tuple[Any, Any]:
    product = a * b
    a_high, a_low = _halves(a)
    b_high, b_low = _halves(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _halves(a: Any) -> tuple[Any, Any]:
    scaled = a * SPLIT
    high = scaled - (scaled - a)
    return high, a - high
