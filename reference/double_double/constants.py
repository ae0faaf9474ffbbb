"""Exact constants of a scene, rounded once to pairs: fractions, and roots and tangents by whole-number arithmetic."""

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from math import isqrt
from typing import Any

import drjit as dr

from rayproof.reference.double_double.pair_arithmetic import Pair

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
