"""Images (..., channels) reduced over their channels, one by one: over so short an axis NumPy takes ten times as long.

Sums run from the first channel to the last, as NumPy's do: the same bits.
"""

from collections.abc import Callable
from functools import reduce

import numpy as np


def _reduced(operation: Callable[[np.ndarray, np.ndarray], np.ndarray], image: np.ndarray) -> np.ndarray:
    return reduce(operation, (image[..., channel] for channel in range(image.shape[-1])))


def any_of(image: np.ndarray) -> np.ndarray:
    """Return where any channel is true (...); nowhere without channels."""
    return _reduced(np.logical_or, image) if image.shape[-1] else np.zeros(image.shape[:-1], dtype=bool)


def all_of(image: np.ndarray) -> np.ndarray:
    """Return where all channels are true (...)."""
    return _reduced(np.logical_and, image) if image.shape[-1] else np.ones(image.shape[:-1], dtype=bool)


def largest(image: np.ndarray) -> np.ndarray:
    """Return the largest channel (...); NaN where one is."""
    return _reduced(np.maximum, image)


def dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return dot products (...) of vectors."""
    # NumPy's sums begin at +0, so that negative zeros add up to +0: atan2 tells the two apart.
    return _reduced(np.add, one * other) + 0.0


def length(vectors: np.ndarray) -> np.ndarray:
    """Return Euclidean lengths (...)."""
    return np.sqrt(dot(vectors, vectors))


def crossed(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the lengths (...) of cross products."""
    x, y, z = (one[..., channel] for channel in range(3))
    u, v, w = (other[..., channel] for channel in range(3))
    across, down, along = y * w - z * v, z * u - x * w, x * v - y * u
    return np.sqrt(across * across + down * down + along * along)
