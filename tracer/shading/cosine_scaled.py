"""The cosine between a surface's normal and the way to a light, scaled first so that no square over- or underflows.

Source: Blue, "A Portable Fortran Program to Find the Euclidean Norm of a Vector", ACM Transactions on Mathematical
Software 4 (1978), for the norm.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("cosine/scaled", covers=("RAD-2",), kind="right", stage=Stage.IRRADIANCE)
def scaled(normal: Any, away: Any) -> Any:
    """Return dot(N, L) with L = away / m over its length, m the largest absolute component."""
    largest = dr.max(abs(away))
    there = largest == 0
    L = away / dr.select(there, 1, largest)
    return dr.select(there, 0, dr.dot(normal, L) / dr.norm(L))
