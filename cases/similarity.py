"""Which matrices keep spheres spheres: those that turn, mirror, move and scale evenly only."""

import numpy as np

from rayproof.cases.scene import Matrix

# One to within the rounding of the float64 numbers that describe it.
SIMILAR = 1e-13


def is_similarity(matrix: Matrix) -> bool:
    """Return whether a matrix changes all lengths by one factor."""
    linear = np.asarray(matrix, dtype=np.float64)[:3, :3]
    gram = linear.T @ linear
    return bool(np.abs(gram / (np.trace(gram) / 3) - np.eye(3)).max() <= SIMILAR)
