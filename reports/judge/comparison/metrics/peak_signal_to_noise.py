"""PSNR: peak signal-to-noise ratio [dB].

As scikit-image has it, to the last bit; that imports SciPy's statistics, most of a second, for this one line.
"""

import numpy as np

from rayproof.reports.judge.comparison.metrics import METRICS


@METRICS.register("psnr")
def peak_signal_to_noise(ours: np.ndarray, theirs: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the PSNR [dB] over the stated range; None without contrast or between equal images."""
    low, high = value_range
    if not high > low or np.array_equal(ours, theirs):
        return None
    return float(10 * np.log10(float(high - low) ** 2 / np.mean(np.square(theirs - ours), dtype=np.float64)))
