"""SSIM: structural similarity, by scikit-image.

Source: Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from error visibility to structural
similarity", IEEE Transactions on Image Processing 13(4), 2004.
"""

import numpy as np

from rayproof.reports.judge.comparison.metrics import METRICS

WINDOW = 7  # px, scikit-image's default


@METRICS.register("ssim")
def structural_similarity(ours: np.ndarray, theirs: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the mean SSIM over the stated range; None for an image smaller than the window or without contrast."""
    low, high = value_range
    if min(ours.shape[:2]) < WINDOW or not high > low:
        return None
    from skimage.metrics import structural_similarity as ssim  # 0.3 s to import, and only wanted here

    mean = ssim(ours, theirs, win_size=WINDOW, channel_axis=-1, data_range=high - low)
    return float(np.asarray(mean))
