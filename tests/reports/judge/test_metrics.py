"""The metrics that are written out here, against the library that has them too."""

import numpy as np
import pytest
from skimage.metrics import normalized_root_mse, peak_signal_noise_ratio

from reports.judge.metrics import METRICS


@pytest.fixture(params=[(np.float32, np.float64), (np.float64, np.float32), (np.float32, np.float32)], ids=str)
def pair(request):
    """Return two images that differ a little, in the precisions that parties answer in."""
    random = np.random.default_rng(7)
    ours = random.random((9, 11, 3))
    mine, their = request.param
    return ours.astype(mine), (ours + 1e-3 * random.random(ours.shape)).astype(their)


def test_psnr_and_nrmse_are_those_of_scikit_image(pair):
    ours, theirs = pair
    assert METRICS["psnr"](ours, theirs, (0.0, 0.9)) == peak_signal_noise_ratio(theirs, ours, data_range=0.9)
    assert METRICS["nrmse"](ours, theirs, (0.0, 0.9)) == normalized_root_mse(theirs, ours)


def test_equal_black_or_flat_images_have_none():
    black = np.zeros((9, 11, 3))
    assert METRICS["psnr"](black + 1, black + 1, (0.0, 1.0)) is None
    assert METRICS["psnr"](black + 1, black, (1.0, 1.0)) is None
    assert METRICS["nrmse"](black + 1, black, (0.0, 1.0)) is None
