"""Vectors of any numbers: pairs of float64 arrays, balls, rationals. Truth is written in these words alone."""

from collections.abc import Sequence
from typing import Any

Triple = tuple[Any, Any, Any]


def minus(a: Sequence[Any], b: Sequence[Any]) -> Triple:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def plus(a: Sequence[Any], b: Sequence[Any]) -> Triple:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def times(a: Sequence[Any], factor: Any) -> Triple:
    """Return factor a."""
    return a[0] * factor, a[1] * factor, a[2] * factor


def dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """Return the dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[Any], b: Sequence[Any]) -> Triple:
    """Return the cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def normalized(a: Sequence[Any]) -> Triple:
    """Return a / abs(a)."""
    length = dot(a, a).sqrt()
    return a[0] / length, a[1] / length, a[2] / length
