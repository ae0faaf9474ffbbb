"""PSNR: peak signal-to-noise ratio [dB], by scikit-image."""

import numpy as np

from rayproof.reports.judge.comparison.metrics import METRICS


@METRICS.register("psnr")
def peak_signal_to_noise(ours: np.ndarray, theirs: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the PSNR [dB] over the stated range; None without contrast or between equal images."""
    low, high = value_range
    if not high > low or np.array_equal(ours, theirs):
        return None
    from skimage.metrics import peak_signal_noise_ratio

    return float(peak_signal_noise_ratio(theirs, ours, data_range=high - low))
