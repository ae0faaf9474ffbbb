"""Metrics that are written out, so that scikit-image need not be imported, are its own to the last bit."""

from typing import Any

import numpy as np
import pytest
from skimage.metrics import normalized_root_mse, peak_signal_noise_ratio

from rayproof.reports.judge.metrics import METRICS


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_errors_are_those_of_scikit_image(kind: Any, scale: float) -> None:
    generator = np.random.default_rng(3)
    theirs = (scale * generator.normal(size=(30, 41, 3))).astype(kind)
    ours = theirs + (0.01 * scale * generator.normal(size=theirs.shape)).astype(kind)
    low, high = float(theirs.min()), float(theirs.max())

    with np.errstate(all="ignore"):
        found = [METRICS[name](ours, theirs, (low, high)) for name in ("nrmse", "psnr")]
        expected = [
            normalized_root_mse(theirs, ours), peak_signal_noise_ratio(theirs, ours, data_range=high - low)
        ]  # fmt: skip

    np.testing.assert_array_equal(found, expected)


def test_what_has_no_error_to_speak_of_has_none() -> None:
    image = np.ones((4, 4, 3))

    assert METRICS["nrmse"](image, 0 * image, (0.0, 1.0)) is None
    assert METRICS["psnr"](image, image, (0.0, 1.0)) is None
    assert METRICS["psnr"](image, 0 * image, (1.0, 1.0)) is None
