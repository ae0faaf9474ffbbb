"""Bundles as a field of the geometry: a sign that all pixels share is an answer, another says how they part."""

from typing import Any

import numpy as np
from flint import arb, fmpq

from rayproof.reference.certified.bundles.numbers import SAFE, TINY, Bundle, larger
from rayproof.reference.certified.fields import UndecidedError

UNKNOWN = 2


class PartedError(Exception):
    """The pixels of a bundle do not share a sign; `signs` has -1, 0 or 1 for each, or 2 where it is not known."""

    def __init__(self, signs: np.ndarray) -> None:
        super().__init__("a bundle's pixels part here")
        self.signs = signs


class Bundles:
    """Numbers for many pixels at once. Constants are made from balls, so call it inside `precision`."""

    def number(self, value: fmpq) -> Any:
        """Return a rational number; zero as the whole number, which costs nothing."""
        return constant(arb(value)) if value else 0

    def float(self, value: float) -> Any:
        """Return a finite float, which is exact."""
        return constant(arb(value)) if value else 0

    def pi(self) -> Bundle:
        """Return pi."""
        return constant(arb.pi())

    def sqrt(self, value: Bundle) -> Bundle:
        """Return the square root."""
        return value.sqrt()

    def rsqrt(self, value: Bundle) -> Bundle:
        """Return 1 over the square root."""
        return value.rsqrt()

    def tan_degrees(self, angle: fmpq) -> Bundle:
        """Return the tangent of an angle [degrees]."""
        return constant(arb.tan_pi(arb(angle / 180)))

    def sign(self, value: Any) -> int:
        """Return the sign that all pixels share; raise PartedError, or UndecidedError where it is one constant's."""
        if isinstance(value, int):
            return (value > 0) - (value < 0)
        # The low part is no more than half a rounding of the high one.
        sure = np.abs(value.high) > value.radius * SAFE
        nought = (value.high == 0) & (value.radius == 0)
        signs = np.where(sure, np.sign(value.high), np.where(nought, 0, UNKNOWN))
        first = signs.flat[0]
        if first != UNKNOWN and (signs == first).all():
            return int(first)
        if signs.ndim == 0:
            raise UndecidedError
        raise PartedError(signs)

    def largest(self, values: list[Any]) -> Bundle:
        """Return the largest number, pixel by pixel."""
        answer = values[0]
        for value in values[1:]:
            answer = larger(answer, value, sign=1)
        return answer

    def smallest(self, values: list[Any]) -> Bundle:
        """Return the smallest number, pixel by pixel."""
        answer = values[0]
        for value in values[1:]:
            answer = larger(answer, value, sign=-1)
        return answer


def constant(value: arb) -> Bundle:
    """Return a ball as one number for all pixels."""
    high = float(value)
    low = float(value - arb(high))
    rest = abs(value - arb(high) - arb(low))
    radius = 0.0 if rest.is_zero() else float(rest.upper()) * SAFE + TINY
    return Bundle(np.float64(high), np.float64(low), np.float64(radius))
