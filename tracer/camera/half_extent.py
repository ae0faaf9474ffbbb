"""Half-sizes of the image at depth 1, by the tangent of half the vertical angle."""

import math
from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("half_extent/tangent", covers=("CAM-2",), kind="right", stage=Stage.CAMERA, default=True)
def half_extent(Float: Any, fovy: float, aspect: float) -> tuple[Any, Any]:
    """Return (aspect tan(alpha), tan(alpha)) with alpha = fovy / 2; fovy in degrees."""
    alpha = Float(math.radians(fovy) / 2)
    # Not dr.tan, which in float64 is off by alpha^2 / 3 below 1e-4: it returns alpha itself.
    tangent = dr.sin(alpha) / dr.cos(alpha)
    return tangent * aspect, tangent
