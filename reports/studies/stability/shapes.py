"""Conversion of a ladder's inputs to the tracer's rays and shapes, and to numbers with error weights."""

from typing import Any

import numpy as np

from rayproof.reference.certified.columns import Columns
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.shapes.meshes import TriangleArrays
from rayproof.tracer.shapes.primitives import CubeArrays, PlaneArrays, SphereArrays, SquareArrays

# The arguments of an intersection formula on the device: a ladder's columns as the tracer's records.


def record(shape: str, columns: Columns, types: ArrayTypes) -> Any:
    """Return the device record of one shape per ray; cube, plane and square are the unit ones."""
    match shape:
        case "sphere":
            return SphereArrays(center=columns["c"], radius=columns["r"])
        case "triangle":
            return TriangleArrays(first=columns["a"], second=columns["b"], third=columns["c"])
        case "cube":
            return CubeArrays()
        case "plane":
            return PlaneArrays()
        case _:
            return SquareArrays(
                center=types.Vector(0.0, 0.0, 0.0),
                half_width=types.Vector(0.5, 0.0, 0.0),
                half_height=types.Vector(0.0, 0.5, 0.0),
                orthogonal=True,
            )


def ray_of(columns: Columns) -> Ray:
    """Return the ray of the columns o and d."""
    return Ray(origin=columns["o"], direction=columns["d"])


def ahead(types: ArrayTypes) -> Interval:
    """Return the interval of everything in front of the ray's origin."""
    return Interval(nearest=types.Float(0.0), farthest=types.Float(float("inf")))


# Numbers with their condition: the largest change of a value by one rounding of every input, in units of the roundoff.
#
# `weight` is the sum over the inputs of abs(x df/dx), where each path from an input to the value is counted separately,
# so that no two paths cancel: error / (weight u) is error / (K u) for any expression evaluated on such numbers.
# Source: Bauer, "Computational Graphs and Rounding Error", SIAM Journal on Numerical Analysis 11 (1974).


class Conditioned:
    """An array of float64 values and their weights, the error per roundoff; that of an input is its absolute value."""

    __slots__ = ("value", "weight")

    def __init__(self, value: Any, weight: Any = None) -> None:
        self.value = np.asarray(value, dtype=np.float64)
        self.weight = abs(self.value) if weight is None else weight

    @staticmethod
    def of(value: Any) -> "Conditioned":
        """Return `value` as a constant of weight 0, or unchanged if it is `Conditioned` already."""
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
