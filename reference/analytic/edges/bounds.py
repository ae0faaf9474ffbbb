"""How far a function's zero must be: Taylor's theorem turned into a distance in the image."""

import numpy as np


def reach(value: np.ndarray, slope: np.ndarray, bend: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Return a lower bound [px] of the distance to the nearest zero of a function of the image point.

    `value` and `slope` are the function and the length of its gradient here; `bend` bounds its second derivative within
    `radius` [px], beyond which nothing is claimed. The zero is no nearer than the smallest d with
    slope d + bend d^2 / 2 >= |value|.
    """
    size = np.abs(value)
    with np.errstate(all="ignore"):
        # What is linear takes a root for each slope, of which the eye has one for all its rays.
        curved = bend.any() or not np.isfinite(size).all()
        distance = 2 * size / (slope + np.sqrt(slope**2 + 2 * bend * size if curved else slope**2))
    # 0/0 is a function that vanishes here; other NaN are overflows, where nothing can be claimed.
    distance = np.where((size == 0) | np.isnan(distance), 0.0, distance)
    return np.minimum(distance, radius)
