"""Images embedded in the page lose no bit."""

import numpy as np
import pytest

from rayproof.reports.results.float_codec import decode, encode

SPECIAL = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 1e-45, 3.4e38, -1.0], dtype=np.float32).reshape(2, 4, 1)
ZERO = np.zeros_like(SPECIAL)


@pytest.mark.parametrize("prediction", [ZERO, SPECIAL[::-1].copy(), np.ones_like(SPECIAL)], ids=["0", "swapped", "1"])
def test_every_bit_comes_back(prediction):
    stored = encode(SPECIAL, [({"by": "nothing"}, prediction)])

    assert decode(stored, 2, 4, prediction).tobytes() == SPECIAL.tobytes()


def test_every_bit_of_a_smooth_image_comes_back_from_its_second_difference():
    x, y = np.meshgrid(np.linspace(1, 2, 40), np.linspace(3, 4, 30))
    smooth = np.stack([x * y, x - y, np.sqrt(x)], axis=-1).astype(np.float32)

    stored = encode(smooth, [({"by": "nothing"}, np.zeros_like(smooth))])

    assert stored["curved"]
    assert decode(stored, 30, 40, None).tobytes() == smooth.tobytes()


@pytest.mark.parametrize(
    ("image", "predictions"),
    [
        (np.zeros((2, 2, 1)), [({"by": "nothing"}, np.zeros((2, 2, 1)))]),
        (np.zeros((2, 2, 1), np.float32), [({"by": "base"}, np.zeros((2, 3, 1), np.float32))]),
        (np.zeros((2, 2, 1), np.float32), []),
    ],
    ids=["float64", "another shape", "no prediction"],
)
def test_images_that_would_lose_something_are_refused(image, predictions):
    with pytest.raises(ValueError, match="image"):
        encode(image, predictions)
