"""Products of vectors (..., 3), component by component: over so short an axis NumPy's own take several times as long.

Sums run from the first component to the last, as NumPy's do: the same bits. The judge has its own
(`reports.judge.answers`): a bug that both shared would hide itself.
"""

import numpy as np

# Where a point was computed: its height over a surface that it lies on is lost in so many roundings of the coordinates
# that enter it (the ray's foot 8, the crossing 8, the height itself 8, and as many again to spare).
ON_SURFACE = 48 * 2.0**-53


def cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return cross products (..., 3)."""
    found = np.empty(np.broadcast_shapes(one.shape, other.shape))
    for axis, (first, second) in enumerate(((1, 2), (2, 0), (0, 1))):
        crossed = one[..., second] * other[..., first]
        np.subtract(one[..., first] * other[..., second], crossed, out=found[..., axis])
    return found


def dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return dot products (...) of vectors of any dimension."""
    products = one * other
    total = products[..., 0] + 0.0  # where NumPy begins: of negative zeros the sum is none
    for component in range(1, products.shape[-1]):
        total += products[..., component]
    return total


def length(vectors: np.ndarray) -> np.ndarray:
    """Return Euclidean lengths (...) of vectors of any dimension."""
    return np.sqrt(dot(vectors, vectors))
