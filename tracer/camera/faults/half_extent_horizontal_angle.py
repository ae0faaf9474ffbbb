"""Planted fault: fovy taken for the horizontal angle."""

import math
from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("half_extent/fault_horizontal_angle", covers=("CAM-2",), kind="fault", stage=Stage.CAMERA)
def fault_horizontal_angle(Float: Any, fovy: float, aspect: float) -> tuple[Any, Any]:
    """Return half-sizes whose horizontal angle is fovy."""
    tangent = dr.tan(Float(math.radians(fovy) / 2))
    return tangent, tangent / aspect
