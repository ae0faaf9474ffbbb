"""NRMSE: root mean square error over the Euclidean norm of the reference."""

import numpy as np

from reports.judge.metrics import METRICS


@METRICS.register("nrmse")
def root_mean_square(ours: np.ndarray, theirs: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the normalised root mean square error; None where the reference is zero everywhere."""
    if not np.any(theirs):
        return None
    wrong = theirs - ours
    wrong, size = (np.mean(np.square(image, dtype=wrong.dtype), dtype=np.float64) for image in (wrong, theirs))
    return float(np.sqrt(wrong) / np.sqrt(size))
