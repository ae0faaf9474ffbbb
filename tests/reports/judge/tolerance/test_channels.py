"""Reductions over channels give, to the last bit, what NumPy's own over the last axis give."""

from itertools import product

import numpy as np
import pytest

from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import crossed, dot, length
from rayproof.reports.judge.measurement import error

TINY, HUGE = 5e-324, 1.7976931348623157e308
SPECIAL = (0.0, -0.0, TINY, -3 * TINY, 2.2250738585072014e-308, 1.0, -1 / 3, HUGE, -HUGE, np.inf, -np.inf, np.nan)
ROWS, COLUMNS = 24, 32


def images(channels: int) -> list[np.ndarray]:
    """Return images of random numbers of any size, and of every combination of special ones, also as float32."""
    generator = np.random.default_rng(channels)
    size = (ROWS, COLUMNS, channels)
    wild = generator.normal(size=size) * 10.0 ** generator.uniform(-320, 300, size=size)
    plain = generator.normal(size=size)
    special = np.array(list(product(SPECIAL, repeat=min(channels, 3))))
    special = np.concatenate([special, np.roll(special, 1, axis=0)[:, : channels - special.shape[1]]], axis=1)
    found = [plain, wild, special[:, np.newaxis], np.where(generator.random(size) < 0.1, np.nan, plain)]
    with np.errstate(over="ignore"):
        found += [image.astype(np.float32) for image in found]
    # Not as they lie in memory only: turned, and every other pixel.
    return found + [image.swapaxes(0, 1)[::2] for image in found]


def same(found: np.ndarray, expected: np.ndarray) -> bool:
    """Say whether two arrays are of one type and equal to the last bit, the signs of zeros included; NaN is NaN."""
    number = ~np.isnan(expected)
    signs = np.signbit(found)[number], np.signbit(expected)[number]
    return (
        found.dtype == expected.dtype
        and np.array_equal(found, expected, equal_nan=found.dtype.kind == "f")
        and np.array_equal(*signs)
    )


@pytest.fixture(autouse=True)
def quiet():
    """Let special numbers overflow: what comes of them is what is looked at."""
    with np.errstate(all="ignore"):
        yield


@pytest.mark.parametrize("channels", [1, 2, 3, 4, 5])
def test_dot_products_and_lengths(channels):
    for image in images(channels):
        other = image[::-1, ::-1]

        assert same(dot(image, other), np.sum(image * other, axis=-1))
        assert same(length(image), np.sqrt(np.sum(image * image, axis=-1)))


def test_lengths_of_cross_products():
    for image in images(3):
        other = np.roll(image, 1, axis=0)[:, ::-1]
        product_ = np.cross(image, other)

        assert same(crossed(image, other), np.sqrt(np.sum(product_ * product_, axis=-1)))


def test_a_normal_that_is_missing_is_as_wrong_whichever_way_the_right_one_points():
    right, missing = np.full((1, 1, 3), 3**-0.5), np.zeros((1, 1, 3))

    assert error(Stage.NORMAL, missing, right) == error(Stage.NORMAL, missing, -right) == pytest.approx(1.0)
