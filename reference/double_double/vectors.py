"""Vectors of three pairs, and matrices of constants whose zeros cost nothing."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import drjit as dr

from rayproof.cases.scene import Shape, Sphere
from rayproof.reference.double_double.arithmetic import (
    Float,
    Pair,
    Rational,
    cross,
    dot,
    fractions,
    inner,
    inverse_sqrt,
    minus,
    pair,
)

Vector = tuple[Pair, Pair, Pair]


def pair_dot(a: Vector, b: Vector) -> Pair:
    """Return the inner product."""
    return inner(list(zip(a, b, strict=True)))


def terms(a: Vector, b: Vector) -> Float:
    """Return what the terms of an inner product are at most.

    A component may be no more than the roundings of its vector: its own term would then look large beside the sum.
    """
    return _length(a) * _length(b)


def _length(a: Vector) -> Float:
    return dr.abs(a[0].high) + dr.abs(a[1].high) + dr.abs(a[2].high)


def pair_cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    x, y, z = (inner([(a[i], b[j]), (-a[j], b[i])]) for i, j in ((1, 2), (2, 0), (0, 1)))
    return (x, y, z)


def plus(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def pair_minus(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scaled(a: Vector, factor: Pair) -> Vector:
    """Return a times a number."""
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def unit(a: Vector) -> Vector:
    """Return a scaled to unit length."""
    return scaled(a, inverse_sqrt(pair_dot(a, a)))


def constant(values: Sequence[Fraction], float64: Any) -> Vector:
    """Return an exact vector as pairs."""
    x, y, z = (pair(value, float64) for value in values)
    return (x, y, z)


class ConstantMatrix:
    """A constant 3x3 matrix."""

    def __init__(self, rows: Sequence[Sequence[Fraction]], float64: Any) -> None:
        self.zero, self.one = Pair(float64(0), float64(0)), Pair(float64(1), float64(0))
        self.rows = [
            [(axis, None if value == 1 else pair(value, float64)) for axis, value in enumerate(row) if value]
            for row in rows
        ]

    def __call__(self, vector: Vector) -> Vector:
        """Return the matrix times a vector."""
        x, y, z = (self._row(row, vector) for row in self.rows)
        return (x, y, z)

    def _row(self, row: list[tuple[int, Pair | None]], vector: Vector) -> Pair:
        if len(row) == 1 and row[0][1] is None:
            return vector[row[0][0]]
        products = [(self.one if value is None else value, vector[axis]) for axis, value in row]
        return inner(products) if products else self.zero


# Where shapes are, in exact fractions: the inverse of a matrix of floats is rational.


@dataclass(frozen=True, kw_only=True)
class PairPlacement:
    """object point = inverse times (world point - offset)."""

    inverse: tuple[Rational, Rational, Rational]
    offset: Rational

    def local(self, point: Rational) -> Rational:
        """Return a world point [m] in object space."""
        x, y, z = (dot(row, minus(point, self.offset)) for row in self.inverse)
        return (x, y, z)


@lru_cache(maxsize=256)
def placement_of(shape: Shape) -> PairPlacement:
    """Return the exact inverse placement; a sphere's leads to the unit sphere."""
    rows = [[Fraction(float(value)) for value in row] for row in shape.to_world[:3]]
    offset = [row[3] for row in rows]
    if isinstance(shape, Sphere):
        center = fractions(shape.center)
        offset = [move + dot(row[:3], center) for row, move in zip(rows, offset, strict=True)]
        rows = [[value * Fraction(shape.radius) for value in row] for row in rows]
    x, y, z = ([row[axis] for row in rows] for axis in range(3))
    cofactors = (cross(y, z), cross(z, x), cross(x, y))
    volume = dot(x, cofactors[0])
    first, second, third = ((row[0] / volume, row[1] / volume, row[2] / volume) for row in cofactors)
    return PairPlacement(inverse=(first, second, third), offset=(offset[0], offset[1], offset[2]))
