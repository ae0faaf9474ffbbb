"""Irradiance of an isotropic point light by its distance, twice divided by, so that no square over- or underflows.

Source: Blue, "A Portable Fortran Program to Find the Euclidean Norm of a Vector", ACM Transactions on Mathematical
Software 4 (1978), for the norm.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("falloff/scaled", covers=("RAD-1",), kind="right", stage=Stage.IRRADIANCE, by="away")
def scaled(flux: Any, away: Any) -> Any:
    """Return Phi / (4 pi) / r / r [W/m^2] with r = m abs(away / m), m the largest absolute component [m]."""
    largest = dr.max(abs(away))
    r = largest * dr.norm(away / dr.select(largest == 0, 1, largest))
    return flux / (4 * dr.pi) / r / r
