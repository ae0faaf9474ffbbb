"""Images embedded in the page lose no bit."""

import base64
import zlib

import numpy as np
import pytest

from reports.publish.encoding import encode


def decode(stored: dict, shape: tuple[int, ...], base: np.ndarray | None = None) -> np.ndarray:
    """Undo `encode` as html/decode.js does."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(stored["data"])), np.uint8).reshape(4, -1)
    bits = np.ascontiguousarray(planes.T).view(">u4").reshape(-1).astype(np.uint32)
    if stored["against"]:
        assert base is not None
        bits = ((bits >> 1) ^ (0 - (bits & 1))) + base.reshape(-1).view(np.uint32)
    return bits.view(np.float32).reshape(shape)


SPECIAL = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 1e-45, 3.4e38, -1.0], dtype=np.float32).reshape(2, 4, 1)


@pytest.mark.parametrize("base", [None, SPECIAL[::-1].copy(), np.ones_like(SPECIAL)], ids=["alone", "swapped", "ones"])
def test_every_bit_comes_back(base):
    stored = encode(SPECIAL, base)

    assert decode(stored, SPECIAL.shape, base).tobytes() == SPECIAL.tobytes()


def test_an_image_a_few_roundings_away_takes_less_than_a_third():
    random = np.random.default_rng(3)
    base = random.uniform(0.5, 2, (60, 80, 3)).astype(np.float32)
    near = (base * (1 + 1e-7 * random.uniform(-1, 1, base.shape))).astype(np.float32)

    assert len(encode(near, base)["data"]) < len(encode(near)["data"]) / 3


@pytest.mark.parametrize(
    ("image", "base"),
    [(np.zeros((2, 2, 1)), None), (np.zeros((2, 2, 1), np.float32), np.zeros((2, 3, 1), np.float32))],
    ids=["float64", "another shape"],
)
def test_images_that_would_lose_something_are_refused(image, base):
    with pytest.raises(ValueError, match="image"):
        encode(image, base)
