"""Planted fault: radiance clamped to 1, as a display does."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("radiance/fault_clamped", covers=("RAD-4",), kind="fault", stage=Stage.RADIANCE)
def fault_clamped(exitance: Any) -> Any:
    """Return L, at most 1."""
    return dr.minimum(exitance / dr.pi, 1.0)
