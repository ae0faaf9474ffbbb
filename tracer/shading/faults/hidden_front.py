"""Planted fault: the front of one-sided surfaces black in place of the back."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("hidden/fault_front", covers=("RAD-4",), kind="fault", stage=Stage.RADIANCE)
def fault_front(normal: Any, direction: Any) -> Any:
    """Return where the viewer is in front."""
    return dr.dot(normal, direction) < 0
