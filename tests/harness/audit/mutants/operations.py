"""What a mutant does to the value of one field: each rule is a function of arrays, and knows no renderer.

Numbers have the shape (), vectors and colours (3,), lists of points (n, 3), matrices (4, 4). A rule may return what the
scene vocabulary refuses, a singular matrix for example: it stands for what a wrong renderer computes with.
"""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

Operation = Callable[[np.ndarray], np.ndarray]
T = TypeVar("T")

SIGNIFICANDS = (8, 11, 16)  # bits of bfloat16, of half precision, and of what a 16-bit file or texture keeps


def altered(thing: T, **values: object) -> T:
    """Return a copy of a part of a scene with other values, whether they are valid or not."""
    copy: T = object.__new__(type(thing))
    # A mesh keeps the digest of its content, which the copy must work out anew.
    vars(copy).update({name: value for name, value in vars(thing).items() if name != "digest"} | values)
    return copy


def plain(value: np.ndarray) -> Any:
    """Return an array as scenes hold it: numbers and nested tuples of numbers."""
    if value.ndim == 0:
        return value.item()
    return tuple(plain(part) for part in value)


def rounded(bits: int) -> Operation:
    """Return the rule that rounds to so many bits of significand."""

    def round_to(value: np.ndarray) -> np.ndarray:
        significand, exponent = np.frexp(value)
        return np.ldexp(np.round(np.ldexp(significand, bits)), exponent - bits)

    return round_to


def clamped(least: float, most: float) -> Operation:
    """Return the rule that clamps every number."""
    return lambda value: np.clip(value, least, most)


def _normalised(value: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return np.nan_to_num(value / np.linalg.norm(value, axis=-1, keepdims=True))


def _signs(*signs: float) -> Operation:
    return lambda value: value * np.array(signs)


def _ordered(*order: int) -> Operation:
    return lambda value: value[..., list(order)]


ROUNDED: Mapping[str, Operation] = {
    **{f"{bits}_bits": rounded(bits) for bits in SIGNIFICANDS},
    "whole": np.round,
}
NUMBER: Mapping[str, Operation] = {
    "negated": np.negative,
    "inverted": lambda value: 1 / value,
    "squared": np.square,
    **ROUNDED,
}
POINT: Mapping[str, Operation] = {
    "ignored": np.zeros_like,
    "negated": np.negative,
    "x_negated": _signs(-1, 1, 1),
    "y_negated": _signs(1, -1, 1),
    "z_negated": _signs(1, 1, -1),
    "x_y_swapped": _ordered(1, 0, 2),
    "y_z_swapped": _ordered(0, 2, 1),
    "z_x_swapped": _ordered(2, 1, 0),
    "rolled": _ordered(1, 2, 0),
    "normalised": _normalised,
    "absolute": np.abs,
    "clamped_to_1": clamped(-1, 1),
    "clamped_to_100": clamped(-100, 100),
    **ROUNDED,
}
COLOUR: Mapping[str, Operation] = {
    "ignored": np.ones_like,
    "red_green_swapped": _ordered(1, 0, 2),
    "green_blue_swapped": _ordered(0, 2, 1),
    "blue_red_swapped": _ordered(2, 1, 0),
    "rolled": _ordered(1, 2, 0),
    "grey": lambda value: np.full_like(value, value.mean()),
    "red_alone": _ordered(0, 0, 0),
    "squared": np.square,
    "clamped_to_1": clamped(0, 1),
    **{f"{bits}_bits": rounded(bits) for bits in SIGNIFICANDS},
}


def _linear(change: Operation) -> Operation:
    """Return the rule that changes a matrix's 3x3 part and leaves the translation."""

    def change_linear(matrix: np.ndarray) -> np.ndarray:
        changed = matrix.copy()
        changed[:3, :3] = change(matrix[:3, :3])
        return changed

    return change_linear


def _translation(change: Operation) -> Operation:
    """Return the rule that changes a matrix's translation."""

    def change_translation(matrix: np.ndarray) -> np.ndarray:
        changed = matrix.copy()
        changed[:3, 3] = change(matrix[:3, 3])
        return changed

    return change_translation


def _moved_first(matrix: np.ndarray) -> np.ndarray:
    """Move by the translation before the 3x3 part is applied, not after it."""
    return _translation(lambda translation: matrix[:3, :3] @ translation)(matrix)


def _rotation(linear: np.ndarray) -> np.ndarray:
    """Return the nearest rotation, or rotation and mirror, of a 3x3 matrix (polar decomposition)."""
    left, _, right = np.linalg.svd(linear)
    return left @ right


def _even(linear: np.ndarray) -> np.ndarray:
    """Return the rotation times the mean scale."""
    return _rotation(linear) * np.cbrt(abs(np.linalg.det(linear)))


def _not_mirrored(linear: np.ndarray) -> np.ndarray:
    return linear * np.array([1, 1, np.sign(np.linalg.det(linear))])


LINEAR: Mapping[str, Operation] = {
    "transposed": np.transpose,
    "inverted": np.linalg.inv,
    "inverse_transposed": lambda linear: np.linalg.inv(linear).T,
    "ignored": lambda linear: np.eye(3),
    "not_mirrored": _not_mirrored,
    "columns_normalised": lambda linear: linear / np.linalg.norm(linear, axis=0),
    "rotation_alone": _rotation,
    "scale_alone": lambda linear: np.diag(np.linalg.norm(linear, axis=0)),
    "scale_even": _even,
    "diagonal_alone": lambda linear: np.diag(np.diag(linear)),
    "rows_swapped": lambda linear: linear[[1, 0, 2]],
    "columns_swapped": lambda linear: linear[:, [1, 0, 2]],
    "rounded_to_8_bits": rounded(8),
}
MATRIX: Mapping[str, Operation] = {
    "ignored": lambda matrix: np.eye(4),
    "inverse": np.linalg.inv,
    "negated": _linear(np.negative),
    "moved_first": _moved_first,
    "translation_ignored": _translation(np.zeros_like),
    "translation_negated": _translation(np.negative),
    "translation_alone": _linear(lambda linear: np.eye(3)),
    "translation_rounded": _translation(rounded(11)),
    "translation_clamped": _translation(clamped(-100, 100)),
    "clamped_to_1": _linear(clamped(-1, 1)),
    **{f"{bits}_bits": rounded(bits) for bits in SIGNIFICANDS},
    **{f"linear_{name}": _linear(change) for name, change in LINEAR.items() if name != "ignored"},
}
