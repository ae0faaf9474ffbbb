"""What judging reads of the oracle's edges: how far away they are, and what no distance in the image can say."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np


class LightEnd(Protocol):
    """A light near a shape's surface, and the pixels whose view of it hangs on which side of the surface it lies."""

    light: int
    shape: int
    face: int
    gap: float  # m
    pixels: np.ndarray  # (height, width)
    depth: np.ndarray  # (height, width) m: how deep below a curved surface the way to the light gets just before it
    chord: np.ndarray  # (height, width) m: how far before the light it enters there


class Edges(Protocol):
    """The oracle's distances to the nearest edge [px]; inf where there is none."""

    silhouette: np.ndarray  # (height, width)
    shadow: np.ndarray  # (height, width, lights)
    terminator: np.ndarray  # (height, width, lights)
    gap: np.ndarray  # (height, width) m: along the ray from the hit to the nearest other surface
    behind: np.ndarray  # (height, width): that surface's shape, -1 without one
    light_ends: Sequence[LightEnd]
    eye_gaps: np.ndarray  # (shapes,) m, of each shape: how far its surface is from the eye at least
