"""Planted fault: the given up vector used as it is, not at right angles to forward."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register(
    "basis/fault_up_as_given", covers=("CAM-1",), kind="fault", cases=("cameras/slanted_up",), stage=Stage.CAMERA
)
def fault_up_as_given(eye: Any, target: Any, up: Any) -> tuple[Any, Any, Any]:
    """Return a frame whose up is not orthogonal to forward."""
    forward = dr.normalize(target - eye)
    right = dr.normalize(dr.cross(forward, dr.normalize(up)))
    return right, dr.normalize(up), forward
