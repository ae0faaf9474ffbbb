"""Vectors of three numbers of any field, and exact matrices whose zeros and ones cost nothing."""

from collections.abc import Sequence
from typing import Any

from flint import fmpq

from rayproof.reference.certified.fields import Field, Number, Vector

Rational = tuple[fmpq, fmpq, fmpq]


def dot(left: Any, right: Any) -> Any:
    """Return the inner product."""
    return left[0] * right[0] + left[1] * right[1] + left[2] * right[2]


def cross(left: Any, right: Any) -> Any:
    """Return the vector product."""
    return (
        left[1] * right[2] - left[2] * right[1],
        left[2] * right[0] - left[0] * right[2],
        left[0] * right[1] - left[1] * right[0],
    )


def minus(left: Any, right: Any) -> Any:
    """Return left - right."""
    return (left[0] - right[0], left[1] - right[1], left[2] - right[2])


def along(start: Any, factor: Any, direction: Any) -> Any:
    """Return start + factor direction."""
    return (
        start[0] + factor * direction[0],
        start[1] + factor * direction[1],
        start[2] + factor * direction[2],
    )


def scaled(vector: Any, factor: Any) -> Any:
    """Return factor vector."""
    return (vector[0] * factor, vector[1] * factor, vector[2] * factor)


def numbers(field: Field, values: Sequence[fmpq]) -> Vector:
    """Return exact rationals as a vector of a field."""
    return (field.number(values[0]), field.number(values[1]), field.number(values[2]))


class Row:
    """A rational row vector in a field: inner products skip its zeros and do not multiply by its ones."""

    def __init__(self, field: Field, values: Sequence[fmpq]) -> None:
        self.zero = field.number(fmpq(0))
        self.terms = [(axis, None if value == 1 else field.number(value)) for axis, value in enumerate(values) if value]

    def __call__(self, vector: Vector) -> Number:
        """Return the inner product with a vector."""
        total = None
        for axis, value in self.terms:
            term = vector[axis] if value is None else vector[axis] * value
            total = term if total is None else total + term
        return self.zero if total is None else total


def rows(field: Field, matrix: Sequence[Sequence[fmpq]]) -> tuple[Row, Row, Row]:
    """Return a 3x3 rational matrix as three rows."""
    return (Row(field, matrix[0]), Row(field, matrix[1]), Row(field, matrix[2]))


def applied(matrix: tuple[Row, Row, Row], vector: Vector) -> Vector:
    """Return the matrix times a vector."""
    return (matrix[0](vector), matrix[1](vector), matrix[2](vector))
