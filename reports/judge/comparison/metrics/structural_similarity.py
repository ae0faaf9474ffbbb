"""SSIM: structural similarity, by scikit-image.

Source: Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from error visibility to structural
similarity", IEEE Transactions on Image Processing 13(4), 2004.
"""

from typing import Any

import numpy as np

from rayproof.reports.judge.comparison.metrics import METRICS

REACH = 5  # px on either side of the window's middle, and
SIGMA = 1.5  # px of its Gaussian: the article's own, and the page's (`ssim.js`)


@METRICS.register("ssim")
def structural_similarity(ours: np.ndarray, theirs: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the mean over pixels of each one's worst channel, over the stated range; None without contrast.

    An image smaller than the window has none. The page's map of 1 - SSIM has the same values, pixel by pixel.
    """
    low, high = value_range
    if min(ours.shape[:2]) < 2 * REACH + 1 or not high > low:
        return None
    from skimage.metrics import structural_similarity as ssim  # 0.3 s to import, and only wanted here

    found: Any = ssim(
        ours, theirs, channel_axis=-1, data_range=high - low, full=True, gaussian_weights=True, sigma=SIGMA,
        use_sample_covariance=False, truncate=REACH / SIGMA,
    )  # fmt: skip
    return float(found[1].min(axis=-1).mean())
