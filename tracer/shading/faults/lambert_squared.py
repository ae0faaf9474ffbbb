"""Planted fault: the cosine squared."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("lambert/fault_squared", covers=("RAD-2",), kind="fault", stage=Stage.IRRADIANCE)
def fault_squared(irradiance: Any, cosine: Any) -> Any:
    """Return E dot(N, L)^2."""
    return dr.select(cosine <= 0, 0, irradiance * cosine * cosine)
