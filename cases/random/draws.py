"""Random numbers that stay the same for ever: raw 64-bit words of PCG64, turned into numbers by arithmetic of our own.

numpy promises its bit generators' words and how they are seeded from one version to the next, but not what its
distributions make of them (NumPy Enhancement Proposal 19).
"""

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from rayproof.cases.scene import Vector

T = TypeVar("T")
STEP = 2.0**-53  # between neighbouring uniform numbers


class Draws:
    """A stream of random numbers for one scene, seeded by whole numbers."""

    def __init__(self, *seed: int) -> None:
        self._words = np.random.PCG64(seed)

    def uniform(self, low: float = 0.0, high: float = 1.0) -> float:
        """Return a number of [low, high)."""
        return low + (high - low) * (int(self._words.random_raw()) >> 11) * STEP

    def logarithmic(self, low: float, high: float) -> float:
        """Return a number of [low, high), whose logarithm is uniform."""
        return math.exp(self.uniform(math.log(low), math.log(high)))

    def whole(self, low: int, high: int) -> int:
        """Return a whole number from `low` to `high`, both included."""
        return low + int(self.uniform() * (high - low + 1))

    def chance(self, probability: float) -> bool:
        """Return True with the given probability."""
        return self.uniform() < probability

    def choice(self, options: Sequence[T]) -> T:
        """Return one of the options, each as likely as any other."""
        return options[self.whole(0, len(options) - 1)]

    def vector(self, low: float, high: float) -> Vector:
        """Return three numbers of [low, high)."""
        return (self.uniform(low, high), self.uniform(low, high), self.uniform(low, high))

    def direction(self) -> Vector:
        """Return a point of the unit sphere, uniform by area (Archimedes: height and azimuth are)."""
        height, turn = self.uniform(-1, 1), self.uniform(0, 2 * math.pi)
        across = math.sqrt(1 - height * height)
        return (across * math.cos(turn), across * math.sin(turn), height)
