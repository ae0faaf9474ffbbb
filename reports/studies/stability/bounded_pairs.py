"""Numbers as unevaluated sums of two float64 arrays, each with a running bound on its own error.

NumPy, so that truth shares no compiler with the tracer; products by Dekker's splitting, so that it needs no fused
multiply-add. A predicate whose value does not exceed its bound is settled elsewhere, by exact rationals.
Sources: Dekker, "A Floating-Point Technique for Extending the Available Precision" (1971); Shewchuk, "Adaptive
Precision Floating-Point Arithmetic" (1997).
"""

from typing import Any

import numpy as np

SPLITTER = 134217729.0  # 2^27 + 1
ROUNDING = 2.0**-102  # above the relative error of every operation below


def _two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    total = a + b
    other = total - a
    return total, (a - (total - other)) + (b - other)


def _split(a: Any) -> tuple[Any, Any]:
    scaled = SPLITTER * a
    high = scaled - (scaled - a)
    return high, a - high


def _two_product(a: Any, b: Any) -> tuple[Any, Any]:
    product = a * b
    a_high, a_low = _split(a)
    b_high, b_low = _split(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


class Pair:
    """An array of double-double numbers `high + low`, off by at most `error`."""

    __slots__ = ("error", "high", "low")

    def __init__(self, high: Any, low: Any = 0.0, error: Any = 0.0) -> None:
        self.high, self.low, self.error = np.asarray(high, dtype=np.float64), low, error

    @staticmethod
    def of(value: Any) -> "Pair":
        """Return a float, or an array of floats, as exact numbers."""
        return value if isinstance(value, Pair) else Pair(value)

    def __add__(self, other: Any) -> "Pair":
        other = Pair.of(other)
        high, low = _two_sum(self.high, other.high)
        tail, rest = _two_sum(self.low, other.low)
        high, low = _two_sum(high, low + tail)
        high, low = _two_sum(high, low + rest)
        return Pair(high, low, self.error + other.error + abs(high) * ROUNDING)

    __radd__ = __add__

    def __neg__(self) -> "Pair":
        return Pair(-self.high, -np.asarray(self.low), self.error)

    def __sub__(self, other: Any) -> "Pair":
        return self + -Pair.of(other)

    def __rsub__(self, other: Any) -> "Pair":
        return Pair.of(other) - self

    def __mul__(self, other: Any) -> "Pair":
        other = Pair.of(other)
        high, low = _two_product(self.high, other.high)
        high, low = _two_sum(high, low + (self.high * other.low + self.low * other.high))
        error = abs(self.high) * other.error + abs(other.high) * self.error + self.error * other.error
        return Pair(high, low, error + abs(high) * ROUNDING)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> "Pair":
        other = Pair.of(other)
        quotient = self.high / other.high
        rest = self - other * Pair(quotient)
        second = rest.high / other.high
        rest = rest - other * Pair(second)
        high, low = _two_sum(quotient, second)
        high, low = _two_sum(high, low + rest.high / other.high)
        error = (self.error + abs(high) * other.error) / abs(other.high) + abs(high) * ROUNDING
        return Pair(high, low, error)

    def __rtruediv__(self, other: Any) -> "Pair":
        return Pair.of(other) / self

    def __abs__(self) -> "Pair":
        flip = np.where(self.high < 0, -1.0, 1.0)
        return Pair(self.high * flip, self.low * flip, self.error)

    def sqrt(self) -> "Pair":
        """Return the square root; of a negative number NaN."""
        root = np.sqrt(self.high)
        safe = np.where(root == 0, 1.0, root)
        rest = self - Pair(root) * Pair(root)
        high, low = _two_sum(root, rest.high / (2 * safe))
        return Pair(high, low, self.error / (2 * safe) + abs(high) * ROUNDING)

    def sign(self) -> np.ndarray:
        """Return -1, 0 or 1 per entry, NaN where the bound does not exclude another sign."""
        sure = (abs(self.high) > self.error) | ((self.high == 0) & (np.asarray(self.error) == 0))
        return np.where(sure, np.sign(self.high), np.nan)

    def minus(self, other: Any) -> np.ndarray:
        """Return the difference to float64 numbers, as float64."""
        return (self - Pair(other)).high
