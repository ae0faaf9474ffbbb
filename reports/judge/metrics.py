"""Metrics of images for the reader: PSNR, relative MSE, NRMSE, SSIM. They do not affect verdicts.

To add one: a function `(image, truth, value_range) -> float | None` on float64 images of shape (height, width,
channels), finite everywhere, under `@METRICS.register("name")`. It returns None if the metric is not defined.
PSNR and NRMSE are scikit-image's to the last bit; scikit-image imports SciPy's statistics for each, most of a second.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rayproof.cases.registry import Registry

Metric = Callable[[np.ndarray, np.ndarray, tuple[float, float]], float | None]
METRICS: Registry[Metric] = Registry("metric", package="rayproof.reports.judge.metrics")
SOFTENING = 0.01  # of the relative mean square error, in units of the image's range
REACH = 5  # px on either side of the middle of SSIM's window, and
SIGMA = 1.5  # px of its Gaussian: the article's own, and the page's (`metrics.js`)


@METRICS.register("psnr")
def peak_signal_to_noise(image: np.ndarray, truth: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the PSNR [dB] over the stated range; None without contrast or between equal images."""
    low, high = value_range
    if not high > low or np.array_equal(image, truth):
        return None
    return float(10 * np.log10(float(high - low) ** 2 / np.mean(np.square(truth - image), dtype=np.float64)))


@METRICS.register("relative_mse")
def relative_mean_square(image: np.ndarray, truth: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the mean of (image - truth)^2 / (truth^2 + softening); None without contrast.

    Source: Rousselle, Knaus and Zwicker, Adaptive sampling and reconstruction using greedy error minimization, ACM
    Transactions on Graphics 30(6), 2011; with their 0.01 against division by zero.
    """
    low, high = value_range
    scale = max(abs(low), abs(high))
    if not scale > 0:
        return None
    return float(np.mean((image - truth) ** 2 / (truth**2 + SOFTENING * scale**2)))


@METRICS.register("nrmse")
def root_mean_square(image: np.ndarray, truth: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the root mean square error over the reference's Euclidean norm; None if that is zero."""
    if not np.any(truth):
        return None
    norm = np.sqrt(np.mean(np.square(truth), dtype=np.float64))
    return float(np.sqrt(np.mean(np.square(truth - image), dtype=np.float64)) / norm)


@METRICS.register("ssim")
def structural_similarity(image: np.ndarray, truth: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the mean over pixels of each pixel's worst channel, over the stated range; None without contrast.

    Source: Wang, Bovik, Sheikh and Simoncelli, Image quality assessment: from error visibility to structural
    similarity, IEEE Transactions on Image Processing 13(4), 2004. An image smaller than the window has none.
    The page's map of 1 - SSIM has the same values, pixel by pixel.
    """
    low, high = value_range
    if min(image.shape[:2]) < 2 * REACH + 1 or not high > low:
        return None
    from skimage.metrics import structural_similarity as ssim  # 0.3 s to import, and only wanted here

    similarity: Any = ssim(
        image, truth, channel_axis=-1, data_range=high - low, full=True, gaussian_weights=True, sigma=SIGMA,
        use_sample_covariance=False, truncate=REACH / SIGMA,
    )  # fmt: skip
    return float(similarity[1].min(axis=-1).mean())
