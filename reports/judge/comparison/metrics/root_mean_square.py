"""NRMSE: root mean square error over the Euclidean norm of the reference, by scikit-image."""

import numpy as np

from rayproof.reports.judge.comparison.metrics import METRICS


@METRICS.register("nrmse")
def root_mean_square(ours: np.ndarray, theirs: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the normalised root mean square error; None where the reference is zero everywhere."""
    if not np.any(theirs):
        return None
    from skimage.metrics import normalized_root_mse

    return float(normalized_root_mse(theirs, ours, normalization="euclidean"))
