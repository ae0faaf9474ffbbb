"""How far Mitsuba keeps its feelers from what they leave and from what they reach.

Source: Mitsuba 3.9.1, core/math.h and render/interaction.h (`offset_p`, `spawn_ray_to`).
"""

import numpy as np

# 1500 times the unit roundoff of float32.
RAY_EPSILON = 1500 * 2.0**-24
# A feeler ends this fraction of its length short of the light: blockers nearer to the light do not count.
SHADOW_EPSILON = 10 * RAY_EPSILON


def offsets(positions: np.ndarray) -> np.ndarray:
    """Return how far [m] along the normal a feeler starts above each position (..., 3): blockers below do not count."""
    return RAY_EPSILON * (1.0 + np.abs(positions).max(axis=-1))
