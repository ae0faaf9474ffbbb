"""`NumberField` and `Balls`: the numbers in which the truth is computed, balls of Arb that contain the exact value.

Source: Johansson, "Arb: efficient arbitrary-precision midpoint-radius interval arithmetic", IEEE Transactions on
Computers 66 (2017). The geometry is written once for any field; the module `numbers` contains the exact field.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from flint import arb, ctx, fmpq

START, MOST = 128, 4096  # bits

Number = Any  # arb or numbers.Algebraic: + - * / with each other and with integers
Vector = tuple[Number, Number, Number]


class UndecidedError(Exception):
    """A sign cannot be decided at this precision: the exact value may be zero."""


class NumberField(Protocol):
    """The operations that the geometry needs beyond arithmetic."""

    def number(self, value: fmpq) -> Number:
        """Return a rational number as a number of this field."""
        ...

    def float(self, value: float) -> Number:
        """Return a finite float as a number of this field."""
        ...

    def pi(self) -> Number:
        """Return pi."""
        ...

    def sqrt(self, value: Number) -> Number:
        """Return the square root of a number that is known not to be negative."""
        ...

    def rsqrt(self, value: Number) -> Number:
        """Return 1 over the square root of a number that is known to be positive."""
        ...

    def tan_degrees(self, angle: fmpq) -> Number:
        """Return the tangent of an angle [degrees]."""
        ...

    def sign(self, value: Number) -> int:
        """Return -1, 0 or 1; raise UndecidedError."""
        ...

    def largest(self, values: list[Number]) -> Number:
        """Return the largest number, if possible without a decision which one it is."""
        ...

    def smallest(self, values: list[Number]) -> Number:
        """Return the smallest number, if possible without a decision which one it is."""
        ...


class Balls:
    """Field of arb balls of `bits` bits. Every branch of the geometry is a call of `sign`, certified or undecided."""

    def __init__(self, bits: int) -> None:
        self.bits = bits

    def number(self, value: fmpq) -> arb:
        """Return a ball around a rational number; exact if the bits suffice."""
        return arb(value)

    def float(self, value: float) -> arb:
        """Return a finite float, which is exact."""
        return arb(value)

    def pi(self) -> arb:
        """Return pi."""
        return arb.pi()

    def rsqrt(self, value: arb) -> arb:
        """Return 1 over the square root."""
        return value.rsqrt()

    def sqrt(self, value: arb) -> arb:
        """Return the square root; the part of the ball below zero is known to be empty."""
        return value.sqrt() if value > 0 else value.nonnegative_part().sqrt()

    def tan_degrees(self, angle: fmpq) -> arb:
        """Return the tangent of an angle [degrees]."""
        return arb.tan_pi(arb(angle / 180))

    def sign(self, value: arb) -> int:
        """Return -1, 0 or 1; raise UndecidedError if the ball contains zero and other numbers."""
        if value > 0:
            return 1
        if value < 0:
            return -1
        if value.is_zero():
            return 0
        raise UndecidedError

    def largest(self, values: list[arb]) -> arb:
        """Return a ball around the largest number, without a branch, so that an exact tie needs no decision."""
        answer = values[0]
        for value in values[1:]:
            answer = answer.max(value)
        return answer

    def smallest(self, values: list[arb]) -> arb:
        """Return a ball around the smallest number."""
        answer = values[0]
        for value in values[1:]:
            answer = answer.min(value)
        return answer


@contextmanager
def precision(bits: int) -> Iterator[Balls]:
    """Compute with `bits` bits inside the body."""
    before = ctx.prec
    ctx.prec = bits
    try:
        yield Balls(bits)
    finally:
        ctx.prec = before


def exact(value: float) -> fmpq:
    """Return a finite float as an exact rational number."""
    numerator, denominator = float(value).as_integer_ratio()
    return fmpq(numerator, denominator)
