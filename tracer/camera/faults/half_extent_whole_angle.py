"""Planted fault: fovy taken for half the vertical angle."""

import math
from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("half_extent/fault_whole_angle", covers=("CAM-2",), kind="fault", stage=Stage.CAMERA)
def fault_whole_angle(Float: Any, fovy: float, aspect: float) -> tuple[Any, Any]:
    """Return the half-sizes for alpha = fovy."""
    tangent = dr.tan(Float(math.radians(fovy)))
    return tangent * aspect, tangent
