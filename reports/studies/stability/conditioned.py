"""Numbers with their condition: what one rounding of every input, times the sum's own cancellation, may do to a value.

`weight` is the sum over the inputs of abs(x df/dx), each way from an input to the value counted by itself, so that no
two of them cancel: error / (weight u) is error / (K u) for whatever expression is evaluated on such numbers.
Source: Bauer, "Computational Graphs and Rounding Error", SIAM Journal on Numerical Analysis 11 (1974).
"""

from typing import Any

import numpy as np


class Conditioned:
    """An array of float64 values and of their weights; of an input, its own size."""

    __slots__ = ("value", "weight")

    def __init__(self, value: Any, weight: Any = None) -> None:
        self.value = np.asarray(value, dtype=np.float64)
        self.weight = abs(self.value) if weight is None else weight

    @staticmethod
    def of(value: Any) -> "Conditioned":
        """Return a constant, which no rounding moves, or what is one of these already."""
        return value if isinstance(value, Conditioned) else Conditioned(value, 0.0)

    def __add__(self, other: Any) -> "Conditioned":
        other = Conditioned.of(other)
        return Conditioned(self.value + other.value, self.weight + other.weight)

    __radd__ = __add__

    def __neg__(self) -> "Conditioned":
        return Conditioned(-self.value, self.weight)

    def __sub__(self, other: Any) -> "Conditioned":
        return self + -Conditioned.of(other)

    def __rsub__(self, other: Any) -> "Conditioned":
        return Conditioned.of(other) - self

    def __mul__(self, other: Any) -> "Conditioned":
        other = Conditioned.of(other)
        return Conditioned(self.value * other.value, abs(self.value) * other.weight + self.weight * abs(other.value))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> "Conditioned":
        other = Conditioned.of(other)
        quotient = self.value / other.value
        return Conditioned(quotient, (self.weight + abs(quotient) * other.weight) / abs(other.value))

    def __rtruediv__(self, other: Any) -> "Conditioned":
        return Conditioned.of(other) / self
