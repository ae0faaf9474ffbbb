"""The dark back of a one-sided surface."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.shading import SHADING


@SHADING.register("hidden/back", covers=("RAD-4",), kind="right", stage=Stage.RADIANCE, default=True)
def back(normal: Any, direction: Any) -> Any:
    """Return where the viewer is behind the surface. A NaN is not: it must stay visible as a NaN."""
    return dr.dot(normal, direction) >= 0
