"""NRMSE: root mean square error over the Euclidean norm of the reference.

As scikit-image has it, to the last bit; that imports SciPy's statistics, most of a second, for this one line.
"""

import numpy as np

from rayproof.reports.judge.comparison.metrics import METRICS


@METRICS.register("nrmse")
def root_mean_square(ours: np.ndarray, theirs: np.ndarray, value_range: tuple[float, float]) -> float | None:
    """Return the normalised root mean square error; None where the reference is zero everywhere."""
    if not np.any(theirs):
        return None
    norm = np.sqrt(np.mean(np.square(theirs), dtype=np.float64))
    return float(np.sqrt(np.mean(np.square(theirs - ours), dtype=np.float64)) / norm)
