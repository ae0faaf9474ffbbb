"""Products of vectors component by component are NumPy's own to the last bit."""

import numpy as np
import pytest

from rayproof.reference.analytic.vectors import cross, dot, length

RANDOM = np.random.default_rng(2)


@pytest.fixture(params=[(1, 3), (200, 3), (7, 4, 3)], ids=str)
def vectors(request):
    """Return two arrays of vectors of very different sizes, zeros of both signs among them."""
    found = RANDOM.normal(size=(2, *request.param)) * 10.0 ** RANDOM.integers(-12, 12, (2, *request.param))
    found[RANDOM.random(found.shape) < 0.1] = 0.0
    found[RANDOM.random(found.shape) < 0.1] = -0.0
    return found


def test_cross_products_are_numpy_s(vectors):
    one, other = vectors

    assert cross(one, other).tobytes() == np.cross(one, other).tobytes()
    assert cross(one[0], other).tobytes() == np.cross(one[0], other).tobytes()
    assert cross(one.reshape(-1, 3)[0], other).tobytes() == np.cross(one.reshape(-1, 3)[0], other).tobytes()


def test_sums_and_lengths_are_numpy_s(vectors):
    one, other = vectors

    assert dot(one, other).tobytes() == (one * other).sum(axis=-1).tobytes()
    assert length(one).tobytes() == np.linalg.norm(one, axis=-1).tobytes()
    assert length(one[..., :2]).tobytes() == np.linalg.norm(one[..., :2], axis=-1).tobytes()


def test_a_sum_of_negative_zeros_is_none():
    assert not np.signbit(dot(np.array([[-0.0, -0.0, -0.0]]), np.ones(3)))[0]
