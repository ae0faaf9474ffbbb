"""Arrays of float64 numbers with rigorous error radii: they rule out most of a scene before a ball is spent on it.

Source: Rump, "Fast and parallel interval arithmetic", BIT 39 (1999): midpoint and radius in rounding to nearest, with
the radius's own roundings covered by a factor. A comparison with NaN or infinity tells nothing: it rules out nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from flint import arb, fmpq

UNIT = 2.0**-52  # twice the unit roundoff
SAFE = 1 + 2.0**-45  # covers the roundings of a radius
TINY = 1e-300  # covers underflow


@dataclass(frozen=True)
class Margin:
    """The exact value lies within `radius` of `middle`."""

    middle: np.ndarray
    radius: np.ndarray

    def __add__(self, other: "Margin") -> "Margin":
        middle = self.middle + other.middle
        return Margin(middle, (self.radius + other.radius + np.abs(middle) * UNIT) * SAFE)

    def __sub__(self, other: "Margin") -> "Margin":
        middle = self.middle - other.middle
        return Margin(middle, (self.radius + other.radius + np.abs(middle) * UNIT) * SAFE)

    def __mul__(self, other: "Margin") -> "Margin":
        middle = self.middle * other.middle
        size, other_size = np.abs(self.middle), np.abs(other.middle)
        spread = size * other.radius + self.radius * (other_size + other.radius)
        return Margin(middle, (spread + np.abs(middle) * UNIT) * SAFE + TINY)

    def __truediv__(self, other: "Margin") -> "Margin":
        middle = self.middle / other.middle
        size = np.abs(other.middle)
        spread = (self.radius + np.abs(middle) * other.radius) / (size - other.radius)
        radius = (spread + np.abs(middle) * UNIT) * SAFE + TINY
        return Margin(middle, np.where(size > other.radius * SAFE, radius, np.inf))

    def sqrt(self) -> "Margin":
        """Return the square root of what is known not to be negative."""
        positive = self.middle > self.radius
        middle = np.sqrt(np.where(positive, self.middle, 0))
        sure = (self.radius / middle + middle * UNIT) * SAFE
        return Margin(middle, np.where(positive, sure, np.sqrt(np.abs(self.middle) + self.radius) * SAFE + TINY))

    def __getitem__(self, index: object) -> "Margin":
        return Margin(self.middle[index], self.radius[index])  # pyright: ignore[reportArgumentType, reportCallIssue]

    @property
    def low(self) -> np.ndarray:
        """Return a lower bound."""
        return self.middle - self.radius * SAFE - np.abs(self.middle) * UNIT

    @property
    def high(self) -> np.ndarray:
        """Return an upper bound."""
        return self.middle + self.radius * SAFE + np.abs(self.middle) * UNIT

    def above(self) -> np.ndarray:
        """Return where the value is surely positive."""
        return self.middle > self.radius

    def below(self) -> np.ndarray:
        """Return where the value is surely negative."""
        return -self.middle > self.radius


def of(values: Sequence[fmpq | arb]) -> Margin:
    """Return exact numbers or balls as an array with margins."""
    middle = np.array([float(value if isinstance(value, arb) else arb(value)) for value in values])
    # A ball of 128 bits or more that came from a rational or a short computation is far narrower than one rounding.
    return Margin(middle, np.abs(middle) * (2 * UNIT) + TINY)


def floats(values: np.ndarray) -> Margin:
    """Return float64 numbers, which are exact."""
    return Margin(values, np.zeros_like(values))


def products(rays: Margin, constants: Margin) -> Margin:
    """Return inner products (rays, surfaces) of rows (rays, 3) and (surfaces, 3), summed in any order."""
    size, other = np.abs(rays.middle), np.abs(constants.middle)
    middle = rays.middle @ constants.middle.T
    # Three products and two sums, fused or not: at most gamma(3) of the sum of magnitudes.
    spread = (size + rays.radius) @ (other * (4 * UNIT) + constants.radius).T + rays.radius @ other.T
    return Margin(middle, spread * SAFE + TINY)
