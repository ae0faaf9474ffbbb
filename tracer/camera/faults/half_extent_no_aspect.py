"""Planted fault: the image's aspect dropped, so that circles become ellipses."""

import math
from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("half_extent/fault_no_aspect", covers=("CAM-2",), kind="fault", stage=Stage.CAMERA)
def fault_no_aspect(Float: Any, fovy: float, aspect: float) -> tuple[Any, Any]:
    """Return tan(alpha) twice."""
    tangent = dr.tan(Float(math.radians(fovy) / 2))
    return tangent, tangent
