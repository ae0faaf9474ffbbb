"""Arrays as the plain tuples that scenes are made of."""

from typing import Any

import numpy as np

from rayproof.cases.scene import Matrix, Vector


def vector(values: Any) -> Vector:
    """Return three numbers as a tuple of floats."""
    x, y, z = map(float, np.asarray(values, dtype=np.float64))
    return (x, y, z)


def matrix(entries: Any) -> Matrix:
    """Return a 4x4 array as a tuple of rows."""
    first, second, third, last = ((float(a), float(b), float(c), float(d)) for a, b, c, d in np.asarray(entries))
    return (first, second, third, last)
