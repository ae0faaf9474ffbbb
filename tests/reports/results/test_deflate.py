"""Planes deflated each in its own way are one stream for whatever inflates."""

import zlib

import numpy as np
import pytest

from rayproof.reports.results.deflate import deflated

RANDOM = np.random.default_rng(5)
NOISE = RANDOM.integers(0, 256, 20_000, dtype=np.uint8).tobytes()
RUNS = np.repeat(RANDOM.integers(0, 3, 200, dtype=np.uint8), 100).tobytes()
REPEATS = NOISE[:1000] * 20


@pytest.mark.parametrize(
    "planes",
    [[RUNS, RUNS, REPEATS, NOISE], [REPEATS, NOISE, RUNS, REPEATS], [b"", b"", b"", b""], [b"\1", b"", b"\2", b"\3"]],
    ids=["as usual", "any order", "nothing", "bytes"],
)
def test_every_byte_comes_back(planes):
    assert zlib.decompress(deflated(planes)) == b"".join(planes)


def test_a_plane_that_repeats_takes_little_and_one_of_noise_hardly_more_than_itself():
    assert len(deflated([REPEATS])) < len(REPEATS) / 10
    assert len(deflated([NOISE])) < 1.01 * len(NOISE)
