"""`BoundedPair`: pairs of float64 arrays in NumPy, each with a bound on its error; rationals where a sign is undecided.

NumPy, so that truth shares no compiler with the tracer; products by Dekker's splitting, so that it needs no fused
multiply-add. A predicate whose value does not exceed its bound is settled elsewhere, by exact rationals.
Sources: Dekker, "A Floating-Point Technique for Extending the Available Precision" (1971); Shewchuk, "Adaptive
Precision Floating-Point Arithmetic" (1997).
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from flint import arb, ctx, fmpq

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


class BoundedPair:
    """An array of double-double numbers `high + low`, off by at most `error`."""

    __slots__ = ("error", "high", "low")

    def __init__(self, high: Any, low: Any = 0.0, error: Any = 0.0) -> None:
        self.high, self.low, self.error = np.asarray(high, dtype=np.float64), low, error

    @staticmethod
    def of(value: Any) -> "BoundedPair":
        """Return a float, or an array of floats, as exact numbers."""
        return value if isinstance(value, BoundedPair) else BoundedPair(value)

    def __add__(self, other: Any) -> "BoundedPair":
        other = BoundedPair.of(other)
        high, low = _two_sum(self.high, other.high)
        tail, rest = _two_sum(self.low, other.low)
        high, low = _two_sum(high, low + tail)
        high, low = _two_sum(high, low + rest)
        return BoundedPair(high, low, self.error + other.error + abs(high) * ROUNDING)

    __radd__ = __add__

    def __neg__(self) -> "BoundedPair":
        return BoundedPair(-self.high, -np.asarray(self.low), self.error)

    def __sub__(self, other: Any) -> "BoundedPair":
        return self + -BoundedPair.of(other)

    def __rsub__(self, other: Any) -> "BoundedPair":
        return BoundedPair.of(other) - self

    def __mul__(self, other: Any) -> "BoundedPair":
        other = BoundedPair.of(other)
        high, low = _two_product(self.high, other.high)
        high, low = _two_sum(high, low + (self.high * other.low + self.low * other.high))
        error = abs(self.high) * other.error + abs(other.high) * self.error + self.error * other.error
        return BoundedPair(high, low, error + abs(high) * ROUNDING)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> "BoundedPair":
        other = BoundedPair.of(other)
        quotient = self.high / other.high
        rest = self - other * BoundedPair(quotient)
        second = rest.high / other.high
        rest = rest - other * BoundedPair(second)
        high, low = _two_sum(quotient, second)
        high, low = _two_sum(high, low + rest.high / other.high)
        error = (self.error + abs(high) * other.error) / abs(other.high) + abs(high) * ROUNDING
        return BoundedPair(high, low, error)

    def __rtruediv__(self, other: Any) -> "BoundedPair":
        return BoundedPair.of(other) / self

    def __abs__(self) -> "BoundedPair":
        flip = np.where(self.high < 0, -1.0, 1.0)
        return BoundedPair(self.high * flip, self.low * flip, self.error)

    def sqrt(self) -> "BoundedPair":
        """Return the square root; of a negative number NaN."""
        root = np.sqrt(self.high)
        safe = np.where(root == 0, 1.0, root)
        rest = self - BoundedPair(root) * BoundedPair(root)
        high, low = _two_sum(root, rest.high / (2 * safe))
        return BoundedPair(high, low, self.error / (2 * safe) + abs(high) * ROUNDING)

    def sign(self) -> np.ndarray:
        """Return -1, 0 or 1 per entry, NaN where the bound does not exclude another sign."""
        sure = (abs(self.high) > self.error) | ((self.high == 0) & (np.asarray(self.error) == 0))
        return np.where(sure, np.sign(self.high), np.nan)

    def minus(self, other: Any) -> np.ndarray:
        """Return the difference to float64 numbers, as float64."""
        return (self - BoundedPair(other)).high


# Truth on the very floats received: pairs first, exact rationals where a sign is in doubt, balls as witnesses.


Columns = dict[str, Any]  # named numbers, or triples of them: floats, exact numbers, intervals or Dr.Jit arrays
Mathematics = Callable[[Columns], Columns]
WITNESS_BITS = 512
PER_VALUE = 4  # rays of every value of a sweep that the witness sees


def pairs(inputs: Mapping[str, np.ndarray]) -> Columns:
    """Return inputs (rays,) and (rays, k) as pairs and tuples of pairs."""
    return parts(inputs, BoundedPair)


def parts(inputs: Mapping[str, np.ndarray], number: Callable[[Any], Any]) -> Columns:
    """Return inputs (rays,) and (rays, k) as numbers of a kind that is made from arrays, and tuples of them."""
    return {
        name: number(array) if array.ndim == 1 else tuple(number(array[:, i]) for i in range(array.shape[1]))
        for name, array in inputs.items()
    }


def single(inputs: Mapping[str, np.ndarray], ray: int, number: Callable[[float], Any]) -> Columns:
    """Return one ray's inputs as exact numbers of another kind."""
    return {
        name: number(float(array[ray])) if array.ndim == 1 else tuple(number(float(x)) for x in array[ray])
        for name, array in inputs.items()
    }


def rational(value: float) -> fmpq:
    """Return a finite float as a rational."""
    return fmpq(*value.as_integer_ratio())


def decided(predicates: Mathematics, inputs: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the sign (-1, 0, 1) of every predicate for every ray; what pairs leave in doubt rationals decide."""
    with np.errstate(all="ignore"):
        signs = {name: value.sign() for name, value in predicates(pairs(inputs)).items()}
    doubtful = np.flatnonzero(np.any([np.isnan(sign) for sign in signs.values()], axis=0))
    for ray in doubtful:
        exact = predicates(single(inputs, int(ray), rational))
        for name, value in exact.items():
            signs[name][ray] = (value > 0) - (value < 0)
    return {name: sign.astype(np.int8) for name, sign in signs.items()}


def evaluated(values: Mathematics, inputs: Mapping[str, np.ndarray]) -> dict[str, BoundedPair]:
    """Return every value of the mathematics for every ray."""
    with np.errstate(all="ignore"):
        return values(pairs(inputs))


def witnessed(
    values: Mathematics, inputs: Mapping[str, np.ndarray], found: Mapping[str, BoundedPair], rays: np.ndarray
) -> tuple[int, float]:
    """Return how many values of `rays` a ball of many bits confirmed, and the largest relative distance from one.

    A value that is no number (a root of a negative number, a division by zero) is confirmed by a ball that is none.
    """
    count, worst = 0, 0.0
    old, ctx.prec = ctx.prec, WITNESS_BITS
    try:
        for ray in rays:
            balls = values(single(inputs, int(ray), arb))
            for name, ball in balls.items():
                if ball.is_zero():
                    continue
                pair = found[name]
                high = float(np.broadcast_to(pair.high, inputs_length(inputs))[ray])
                low = float(np.broadcast_to(pair.low, inputs_length(inputs))[ray])
                known = np.isfinite(high) and np.isfinite(low)
                if not ball.is_finite():
                    count += not known
                    continue
                if not known:
                    continue
                count += 1
                worst = max(worst, float(abs((arb(high) + arb(low) - ball) / ball).upper()))
    finally:
        ctx.prec = old
    return count, worst


def confirmed(
    predicates: Mathematics, inputs: Mapping[str, np.ndarray], signs: Mapping[str, np.ndarray], rays: np.ndarray
) -> tuple[int, float]:
    """Return how many signs of `rays` were asked of balls of many bits, and 1 if one contradicts, else 0.

    A ball of zero alone is a tie; one that merely holds zero confirms nothing but a tie.
    """
    count, wrong = 0, False
    old, ctx.prec = ctx.prec, WITNESS_BITS
    try:
        for ray in rays:
            for name, ball in predicates(single(inputs, int(ray), arb)).items():
                sign = int(bool(ball > 0)) - int(bool(ball < 0))
                count, wrong = count + 1, wrong or sign != int(signs[name][ray])
    finally:
        ctx.prec = old
    return count, float(wrong)


def inputs_length(inputs: Mapping[str, np.ndarray]) -> int:
    """Return the number of rays."""
    return len(next(iter(inputs.values())))


def sample(rungs: np.ndarray, per_value: int = PER_VALUE) -> np.ndarray:
    """Return the indices of the first rays of every value."""
    return np.concatenate([np.flatnonzero(rungs == rung)[:per_value] for rung in np.unique(rungs)])


# Vectors of any numbers: pairs of float64 arrays, balls, rationals. Truth is written in these words alone.


Triple = tuple[Any, Any, Any]


def minus(a: Sequence[Any], b: Sequence[Any]) -> Triple:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def plus(a: Sequence[Any], b: Sequence[Any]) -> Triple:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def times(a: Sequence[Any], factor: Any) -> Triple:
    """Return factor a."""
    return a[0] * factor, a[1] * factor, a[2] * factor


def dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """Return the dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[Any], b: Sequence[Any]) -> Triple:
    """Return the cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def normalized(a: Sequence[Any]) -> Triple:
    """Return a / abs(a)."""
    length = dot(a, a).sqrt()
    return a[0] / length, a[1] / length, a[2] / length
