"""Every decision is asked here, so that its margin is known: how far it was from going the other way.

A margin is the size of what is compared with zero over the sum of the magnitudes that it was made of. Below 2^-80 a
pair's own rounding begins to matter, and the pixel should be asked of a certified reference. Margins that are never
looked at cost nothing: Dr.Jit leaves out what no result needs.
"""

from typing import Any

import drjit as dr

from rayproof.reference.double_double.pair_arithmetic import Bool, Float, Pair

LOW_MARGIN = 2.0**-80


class Questions:
    """The smallest margin so far, per pixel."""

    def __init__(self, float64: Any) -> None:
        self.least: Float = float64(dr.inf)

    def note(self, value: Pair, scale: Float, where: Bool = True) -> None:
        """Remember the margin of a decision on the sign of `value`, where it matters."""
        margin = dr.select(scale > 0, value.size() / scale, 0)
        self.least = dr.select(where & (margin < self.least), margin, self.least)

    def is_positive(self, value: Pair, scale: Float, where: Bool = True) -> Bool:
        """Return where `value` is above zero."""
        self.note(value, scale, where)
        return value.is_positive()

    def is_less(self, one: Pair, other: Pair, where: Bool = True, scale: Float | None = None) -> Bool:
        """Return where one number is below the other; `scale` is what they were made of, if more than they are."""
        self.note(one - other, one.size() + other.size() if scale is None else scale, where)
        return one < other
