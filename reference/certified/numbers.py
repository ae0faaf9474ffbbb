"""Exact numbers for ties (`Tower`): fractions of polynomials in square roots and one tangent.

A number is zero if its numerator, with the square of every root replaced, is the zero polynomial; otherwise balls
decide its sign. The root of a square, or of a square times an earlier radicand, needs no new generator.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from flint import Ordering, arb, fmpq, fmpq_mpoly_ctx
from flint.utils.flint_exceptions import DomainError

from rayproof.reference.certified.fields import (
    MOST,
    START,
    Number,
    NumberField,
    UndecidedError,
    Vector,
    exact,
    precision,
)

ROOM = 24  # generators
RING: Any = fmpq_mpoly_ctx.get([f"g{index}" for index in range(ROOM)], Ordering.lex)
GENERATORS = RING.gens()
ONE, ZERO = RING.constant(fmpq(1)), RING.constant(fmpq(0))


@dataclass(frozen=True)
class Algebraic:
    """numerator / denominator, both polynomials in the tower's generators."""

    tower: "Tower"
    numerator: Any
    denominator: Any

    def _other(self, operand: "Algebraic | int") -> "Algebraic":
        return operand if isinstance(operand, Algebraic) else self.tower.number(fmpq(operand))

    def __add__(self, other: "Algebraic | int") -> "Algebraic":
        other = self._other(other)
        if self.denominator == other.denominator:
            return self.tower.made(self.numerator + other.numerator, self.denominator)
        return self.tower.made(
            self.numerator * other.denominator + other.numerator * self.denominator,
            self.denominator * other.denominator,
        )

    def __neg__(self) -> "Algebraic":
        return Algebraic(self.tower, -self.numerator, self.denominator)

    def __sub__(self, other: "Algebraic | int") -> "Algebraic":
        return self + -self._other(other)

    def __mul__(self, other: "Algebraic | int") -> "Algebraic":
        other = self._other(other)
        return self.tower.made(self.numerator * other.numerator, self.denominator * other.denominator)

    def __truediv__(self, other: "Algebraic | int") -> "Algebraic":
        other = self._other(other)
        return self.tower.made(self.numerator * other.denominator, self.denominator * other.numerator)

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: int) -> "Algebraic":
        return self._other(other) - self

    def __rtruediv__(self, other: int) -> "Algebraic":
        return self._other(other) / self


class Tower:
    """The field of exact numbers of one pixel: rationals, and the roots and the tangent that were requested."""

    def __init__(self) -> None:
        self.squares: dict[int, Any] = {}  # generator -> its square, a polynomial
        self.constants: dict[int, Callable[[], arb]] = {}  # generator -> its value, a tangent or pi
        self.free = ROOM - 1  # newer generators are first in the ring's order, so that they are divided out first

    def number(self, value: fmpq) -> Algebraic:
        """Return a rational number."""
        return Algebraic(self, RING.constant(value), ONE)

    def float(self, value: float) -> Algebraic:
        """Return a finite float, which is exact."""
        return self.number(exact(value))

    def made(self, numerator: Any, denominator: Any) -> Algebraic:
        """Return a fraction in normal form.

        Raises:
            ZeroDivisionError: the denominator is zero.

        """
        numerator, denominator = self._reduced(numerator), self._reduced(denominator)
        if denominator.is_zero():
            raise ZeroDivisionError("division by an exact zero")
        if denominator.is_constant():
            return Algebraic(self, numerator / denominator.leading_coefficient(), ONE)
        return Algebraic(self, numerator, denominator)

    def _reduced(self, polynomial: Any) -> Any:
        for generator in sorted(self.squares):
            if polynomial.degrees()[generator] >= 2:
                polynomial = divmod(polynomial, GENERATORS[generator] ** 2 - self.squares[generator])[1]
        return polynomial

    def _new(self) -> int:
        if self.free < 0:
            raise UndecidedError
        self.free -= 1
        return self.free + 1

    def sqrt(self, value: Algebraic) -> Algebraic:
        """Return the square root of a number that is known not to be negative."""
        radicand = self._reduced(value.numerator * value.denominator)
        for earlier, factor in [(ONE, ONE), *((GENERATORS[index], square) for index, square in self.squares.items())]:
            try:
                root = self._reduced(radicand * factor).sqrt()
            except DomainError:
                continue
            # sqrt(n / d) = sqrt(n d) / |d|, and sqrt(n d) = sqrt(n d s) g / s for an earlier g with g^2 = s.
            return self._positive(self.made(root * earlier, value.denominator * factor))
        generator = self._new()
        self.squares[generator] = radicand
        return self._positive(self.made(GENERATORS[generator], value.denominator))

    def rsqrt(self, value: Algebraic) -> Algebraic:
        """Return 1 over the square root of a number that is known to be positive."""
        return 1 / self.sqrt(value)

    def _positive(self, value: Algebraic) -> Algebraic:
        return -value if self.sign(value) < 0 else value

    def tan_degrees(self, angle: fmpq) -> Algebraic:
        """Return the tangent of an angle [degrees]; of the common angles by their square roots."""
        if angle == 45:
            return self.number(fmpq(1))
        closed = {
            fmpq(15): (2, 3, -1),
            fmpq(45, 2): (-1, 2, 1),
            fmpq(30): (0, fmpq(1, 3), 1),
            fmpq(60): (0, 3, 1),
            fmpq(135, 2): (1, 2, 1),
            fmpq(75): (2, 3, 1),
        }
        if angle in closed:
            whole, radicand, sign = closed[angle]
            return self.number(fmpq(whole)) + self.sqrt(self.number(fmpq(radicand))) * sign
        return self._constant(lambda: arb.tan_pi(arb(angle / 180)))

    def pi(self) -> Algebraic:
        """Return pi."""
        return self._constant(arb.pi)

    def _constant(self, value: Callable[[], arb]) -> Algebraic:
        generator = self._new()
        self.constants[generator] = value
        return Algebraic(self, GENERATORS[generator], ONE)

    def sign(self, value: Algebraic) -> int:
        """Return -1, 0 or 1.

        Raises:
            UndecidedError: the number is not recognised as zero, and 4096 bits do not separate it from zero.

        """
        numerator = self._reduced(value.numerator)
        if numerator.is_zero():
            return 0
        product = self._reduced(numerator * value.denominator)
        bits = START
        while bits <= MOST:
            with precision(bits):
                ball = self._ball(product, {})
                if ball > 0 or ball < 0:
                    return 1 if ball > 0 else -1
            bits *= 2
        raise UndecidedError

    def ball(self, value: Algebraic) -> arb:
        """Return a ball around a number, at the current precision."""
        balls: dict[int, arb] = {}
        return self._ball(value.numerator, balls) / self._ball(value.denominator, balls)

    def _ball(self, polynomial: Any, balls: dict[int, arb]) -> arb:
        """Return a ball around a polynomial's value; `balls` caches the balls of generators."""
        total = arb(0)
        for powers, coefficient in polynomial.to_dict().items():
            term = arb(coefficient)
            for generator, power in enumerate(powers):
                if power:
                    if generator not in balls:
                        balls[generator] = self._generator(generator, balls)
                    term *= balls[generator] ** power
            total += term
        return total

    def _generator(self, generator: int, balls: dict[int, arb]) -> arb:
        if generator in self.constants:
            return self.constants[generator]()
        return self._ball(self.squares[generator], balls).nonnegative_part().sqrt()

    def largest(self, values: list[Algebraic]) -> Algebraic:
        """Return the largest number."""
        answer = values[0]
        for value in values[1:]:
            answer = value if self.sign(value - answer) > 0 else answer
        return answer

    def smallest(self, values: list[Algebraic]) -> Algebraic:
        """Return the smallest number."""
        answer = values[0]
        for value in values[1:]:
            answer = value if self.sign(value - answer) < 0 else answer
        return answer


# The interval of valid hits along a ray: the clip interval of a camera ray (HIT-2), the open segment of a shadow ray.


@dataclass(frozen=True, kw_only=True)
class Window:
    """The interval low < t speed < high; None: no lower end but zero, no upper end, or the speed 1."""

    field: NumberField
    low: Number | None  # None: zero
    high: Number | None
    speed: Number | None

    def __contains__(self, t: Number) -> bool:
        """Return whether t is strictly inside; raise UndecidedError."""
        value = t if self.speed is None else t * self.speed
        if self.field.sign(value if self.low is None else value - self.low) <= 0:
            return False
        return self.high is None or self.field.sign(self.high - value) > 0


# Vectors of three numbers of any field, and exact matrices whose zeros and ones cost nothing.


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


def plus(left: Any, right: Any) -> Any:
    """Return left + right."""
    return (left[0] + right[0], left[1] + right[1], left[2] + right[2])


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


def unit(vector: Any) -> Any:
    """Return a vector divided by its length, of numbers that have a method `sqrt`."""
    length = dot(vector, vector).sqrt()
    return (vector[0] / length, vector[1] / length, vector[2] / length)


def numbers(field: NumberField, values: Sequence[fmpq]) -> Vector:
    """Return exact rationals as a vector of a field."""
    return (field.number(values[0]), field.number(values[1]), field.number(values[2]))


class RowVector:
    """A rational row vector in a field: inner products skip its zeros and do not multiply by its ones."""

    def __init__(self, field: NumberField, values: Sequence[fmpq]) -> None:
        self.zero = field.number(fmpq(0))
        self.terms = [(axis, None if value == 1 else field.number(value)) for axis, value in enumerate(values) if value]

    def __call__(self, vector: Vector) -> Number:
        """Return the inner product with a vector."""
        total = None
        for axis, value in self.terms:
            term = vector[axis] if value is None else vector[axis] * value
            total = term if total is None else total + term
        return self.zero if total is None else total


def rows(field: NumberField, matrix: Sequence[Sequence[fmpq]]) -> tuple[RowVector, RowVector, RowVector]:
    """Return a 3x3 rational matrix as three rows."""
    return (RowVector(field, matrix[0]), RowVector(field, matrix[1]), RowVector(field, matrix[2]))


def applied(matrix: tuple[RowVector, RowVector, RowVector], vector: Vector) -> Vector:
    """Return the matrix times a vector."""
    return (matrix[0](vector), matrix[1](vector), matrix[2](vector))
