"""The inverse of a camera matrix: one per camera, never one per pixel."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("inverse/general", covers=("CAM-1", "CAM-2"), kind="right", stage=Stage.CAMERA, default=True)
def inverse(matrix: Any) -> Any:
    """Return the inverse of a 4x4 matrix by cofactors."""
    return dr.rcp(matrix)
