"""Planted fault: the right axis as U x F, which mirrors the image."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("basis/fault_left_handed", covers=("CAM-1",), kind="fault", stage=Stage.CAMERA)
def fault_left_handed(eye: Any, target: Any, up: Any) -> tuple[Any, Any, Any]:
    """Return a left-handed frame: right U x F, up and forward."""
    forward = dr.normalize(target - eye)
    right = dr.normalize(dr.cross(dr.normalize(up), forward))
    return right, dr.cross(forward, right), forward
