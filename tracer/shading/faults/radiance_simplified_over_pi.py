"""Planted fault: the physical 1/pi in the lecture's simplified model."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("radiance_simplified/fault_over_pi", covers=("RAD-3",), kind="fault", stage=Stage.RADIANCE)
def fault_over_pi(exitance: Any) -> Any:
    """Return M / pi."""
    return exitance / dr.pi
