"""PSNR: peak signal-to-noise ratio [dB].

Written out: scikit-image imports all of SciPy's statistics first, which takes longer than judging a case.
"""

import numpy as np

from reports.judge.metrics import METRICS


@METRICS.register("psnr")
def peak_signal_to_noise(ours: np.ndarray, theirs: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the PSNR [dB] over the stated range; None without contrast or between equal images."""
    low, high = value_range
    if not high > low or np.array_equal(ours, theirs):
        return None
    return float(10 * np.log10((high - low) ** 2 / np.mean((theirs - ours) ** 2, dtype=np.float64)))
