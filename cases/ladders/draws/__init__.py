"""Seeded generators of the ladders' inputs: numbers that the working precision has."""

import numpy as np

DTYPES = {"float32": np.float32, "float64": np.float64}


def rounded(values: np.ndarray, precision: str) -> np.ndarray:
    """Return `values` rounded to the working precision, as float64. What overflows becomes an infinity."""
    with np.errstate(over="ignore"):
        return np.asarray(values).astype(DTYPES[precision]).astype(np.float64)


def directions(count: int, generator: np.random.Generator) -> np.ndarray:
    """Return unit vectors in random directions, (count, 3). No rotation is a special one: axes hide rounding errors."""
    vectors = generator.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def across(vectors: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Return random unit vectors at right angles to unit `vectors`."""
    other = np.cross(vectors, directions(len(vectors), generator))
    return other / np.linalg.norm(other, axis=1, keepdims=True)


def rotation(generator: np.random.Generator) -> np.ndarray:
    """Return a random rotation matrix (3, 3)."""
    q, r = np.linalg.qr(generator.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))
