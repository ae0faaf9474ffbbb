"""Exact numbers: what is zero is found to be zero, whatever roots it is written with, and nothing else is."""

from typing import Any

import pytest
from flint import fmpq

from rayproof.reference.certified.fields import UndecidedError
from rayproof.reference.certified.numbers import Tower


def number(tower: Tower, numerator: int, denominator: int = 1) -> Any:
    return tower.number(fmpq(numerator, denominator))


def test_roots_of_related_numbers_are_related() -> None:
    tower = Tower()
    two, eight = tower.sqrt(number(tower, 2)), tower.sqrt(number(tower, 8))

    assert tower.sign(eight - 2 * two) == 0
    assert tower.sign(1 / two - two / 2) == 0
    assert tower.sign(eight - 2 * two + number(tower, 1, 10**300)) == 1
    assert tower.sign(tower.sqrt(number(tower, 9, 4)) - number(tower, 3, 2)) == 0


def test_a_root_of_a_root() -> None:
    tower = Tower()
    inner = 2 + tower.sqrt(number(tower, 3))

    root = tower.sqrt(inner)

    assert tower.sign(root * root - inner) == 0
    assert tower.sign(root - 1) == 1


@pytest.mark.parametrize(
    ("angle", "polynomial"),
    [
        pytest.param(fmpq(45), (-1, 1), id="45"),
        pytest.param(fmpq(30), (-1, 0, 3), id="30"),
        pytest.param(fmpq(60), (-3, 0, 1), id="60"),
        pytest.param(fmpq(45, 2), (-1, 2, 1), id="22.5"),
        pytest.param(fmpq(135, 2), (-1, -2, 1), id="67.5"),
        pytest.param(fmpq(15), (1, -4, 1), id="15"),
        pytest.param(fmpq(75), (1, -4, 1), id="75"),
    ],
)
def test_tangents_of_common_angles_satisfy_their_equation(angle: fmpq, polynomial: tuple[int, ...]) -> None:
    tower = Tower()
    tangent = tower.tan_degrees(angle)

    value = number(tower, 0)
    for coefficient in reversed(polynomial):
        value = value * tangent + coefficient

    assert tower.sign(value) == 0
    assert tower.sign(tangent) == 1
    assert tower.sign(tangent - 1) == (angle > 45) - (angle < 45)


def test_a_tangent_that_is_no_root_is_still_a_number() -> None:
    tower = Tower()
    tangent = tower.tan_degrees(fmpq(20))

    assert tower.sign((tangent + 1) * (tangent - 1) - tangent * tangent + 1) == 0
    assert tower.sign(tangent - number(tower, 36397, 100000)) == 1


def test_a_zero_that_is_not_recognised_is_undecided_and_not_guessed() -> None:
    tower = Tower()
    square = tower.tan_degrees(fmpq(18)) * tower.tan_degrees(fmpq(18))

    with pytest.raises(UndecidedError):
        tower.sign(5 * square * square - 10 * square + 1)
