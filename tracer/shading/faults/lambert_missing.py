"""Planted fault: no cosine at all."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("lambert/fault_missing", covers=("RAD-2",), kind="fault", stage=Stage.IRRADIANCE)
def fault_missing(irradiance: Any, cosine: Any) -> Any:
    """Return E as on a surface that faces the light."""
    return dr.select(cosine <= 0, 0, irradiance)
