"""`Pair`: sums of two float64 in Dr.Jit; product, root, tangent, and `Questions`, the margins of signs.

Source: Joldes, Muller and Popescu, "Tight and rigorous error bounds for basic building blocks of double-word
arithmetic", ACM Transactions on Mathematical Software 44 (2017), algorithms 6, 11 and 17: a sum errs by at most 3 u^2,
a product by 6 u^2, a quotient by 15 u^2, relative, u = 2^-53; inner products after Ogita, Rump and Oishi, "Accurate
sum and dot product", SIAM Journal on Scientific Computing 26 (2005). Knuth's two_sum and the fused two_product must be
computed as written: FastMath off, no contraction.
"""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from fractions import Fraction
from functools import lru_cache
from importlib.util import find_spec
from math import isqrt
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


# Exact constants of a scene, rounded once to pairs: fractions, and roots and tangents by whole-number arithmetic.


DIGITS = 10**60  # roots and tangents are worked out to so many units
Rational = tuple[Fraction, Fraction, Fraction]


def fractions(values: Any) -> Rational:
    """Return three finite floats as the rational numbers that they are."""
    x, y, z = (Fraction(float(value)) for value in values)
    return (x, y, z)


def parts(value: Fraction) -> tuple[float, float]:
    """Return a rational number as high and low float64."""
    high = float(value)
    return high, float(value - Fraction(high))


def pair(value: Fraction, float64: Any) -> Pair:
    """Return a constant that keeps its kernel the same from scene to scene."""
    high, low = parts(value)
    return Pair(dr.opaque(float64, high), dr.opaque(float64, low))


def root(value: Fraction) -> Fraction:
    """Return a square root to at least 60 significant digits."""
    scale = 1
    while value * scale * scale < DIGITS * DIGITS:
        scale *= DIGITS
    return Fraction(isqrt(int(value * scale * scale)), scale)


def tangent(degrees: Fraction) -> Fraction:
    """Return the tangent of an angle in (0, 90), by the series of sine and cosine at a sixteenth of it."""
    angle = degrees * _pi() / 180 / 16
    angle = Fraction(int(angle * DIGITS**2), DIGITS**2)
    sine = cosine = Fraction(0)
    term, power = Fraction(1), 0
    while term * DIGITS**2 > 1:
        signed = term if power % 4 < 2 else -term
        if power % 2:
            sine += signed
        else:
            cosine += signed
        power += 1
        term = Fraction(int(term * angle / power * DIGITS**3), DIGITS**3)
    for _ in range(4):
        sine, cosine = 2 * sine * cosine, cosine * cosine - sine * sine
        sine, cosine = (Fraction(int(part * DIGITS**3), DIGITS**3) for part in (sine, cosine))
    return sine / cosine


def _pi() -> Fraction:
    """Return pi by Machin's formula (1706): 4 (4 arctan(1/5) - arctan(1/239))."""

    def arctan_inverse(number: int) -> Fraction:
        total = power = DIGITS**2 // number
        index, sign = 1, -1
        while power:
            power //= number * number
            index += 2
            total += sign * (power // index)
            sign = -sign
        return Fraction(total, DIGITS**2)

    return 4 * (4 * arctan_inverse(5) - arctan_inverse(239))


PI = _pi()


def dot(left: Sequence[Fraction], right: Sequence[Fraction]) -> Fraction:
    """Return the inner product."""
    return sum((a * b for a, b in zip(left, right, strict=True)), Fraction(0))


def cross(a: Sequence[Fraction], b: Sequence[Fraction]) -> Rational:
    """Return the vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def minus(a: Sequence[Fraction], b: Sequence[Fraction]) -> Rational:
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@lru_cache(maxsize=4096)
def unit(a: Rational) -> Rational:
    """Return a vector scaled to unit length, to at least 60 digits; zero as it is."""
    square = dot(a, a)
    if square == 0:
        return a
    length = root(square)
    return (a[0] / length, a[1] / length, a[2] / length)


# Every decision is asked here, so that its margin is known: how far it was from going the other way.
#
# A margin is the size of what is compared with zero over the sum of the magnitudes that it was made of. Below 2^-80 a
# pair's own rounding begins to matter, and the pixel should be asked of a certified reference. Margins that are never
# looked at cost nothing: Dr.Jit leaves out what no result needs.


LOW_MARGIN = 2.0**-80


class Questions:
    """The smallest margin so far, per pixel."""

    def __init__(self, float64: Any) -> None:
        self.least: Float = float64(dr.inf)

    def note(self, value: Pair, scale: Float, where: Bool = True) -> None:
        """Remember the margin of a decision on the sign of `value`, where it matters."""
        margin = dr.select(scale > 0, value.size() / scale, 0)
        self.least = dr.select(where & (margin < self.least), margin, self.least)

    def is_positive(self, value: Pair, scale: Float, where: Bool = True) -> Bool:
        """Return where `value` is above zero."""
        self.note(value, scale, where)
        return value.is_positive()

    def is_less(self, one: Pair, other: Pair, where: Bool = True, scale: Float | None = None) -> Bool:
        """Return where one number is below the other; `scale` is what they were made of, if more than they are."""
        self.note(one - other, one.size() + other.size() if scale is None else scale, where)
        return one < other


# Work that few rays need, left out where no ray of a packet needs it.


def only_where(needed: Bool, ask: Questions, work: Callable[[Questions], Sequence[Any]]) -> list[Any]:
    """Return what `work` returns, pairs and arrays, where it is needed; elsewhere zero and false.

    Neighbouring rays make a packet, so this pays where rays come in the order of an image.
    """
    kinds: list[type] = []

    def needed_by_some() -> tuple[Any, ...]:
        inner = Questions(type(ask.least))
        values = work(inner)
        kinds.extend(type(value) for value in values)
        parts = [
            part for value in values for part in ((value.high, value.low) if isinstance(value, Pair) else (value,))
        ]
        return (*parts, inner.least)

    def needed_by_none() -> tuple[Any, ...]:
        # Opaque: a literal that both sides return ends in Dr.Jit 1.5.0 outside the scope of its definition.
        float64 = type(ask.least)
        pieces = [part for kind in kinds for part in ((float64, float64) if kind is Pair else (kind,))]
        return (*(dr.opaque(piece, 0) for piece in pieces), dr.opaque(float64, dr.inf))

    *parts, least = dr.if_stmt((), needed, needed_by_some, needed_by_none)
    ask.least = dr.select(least < ask.least, least, ask.least)
    rest = iter(parts)
    return [Pair(next(rest), next(rest)) if kind is Pair else next(rest) for kind in kinds]


# Dr.Jit's LLVM backend, found or explained, with the one flag that pairs depend on.


def unavailable() -> str | None:
    """Return a sentence that says why pairs cannot be computed on this machine, or None if they can.

    On a GPU products may be fused into sums, which breaks the error of a product; so LLVM alone is used.
    """
    if find_spec("drjit") is None:
        return "Dr.Jit is not installed; pip install drjit."
    import drjit

    # Asked first, because using the backend without a library kills the process.
    if not drjit.has_backend(drjit.JitBackend.LLVM):
        return "Dr.Jit finds no LLVM library that it accepts; set DRJIT_LIBLLVM_PATH to one, version 17 or later."
    return None


def types() -> Any:
    """Return the module of Dr.Jit's LLVM arrays."""
    import drjit.llvm

    return drjit.llvm


def fast_math_off() -> AbstractContextManager[None]:
    """Compute the body as written: by default Dr.Jit may reorder, and takes x times 0 for 0."""
    import drjit

    return drjit.scoped_set_flag(drjit.JitFlag.FastMath, False)
