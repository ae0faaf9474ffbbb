"""Planted fault: the direction left as long as it comes."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("ray/fault_not_normalised", covers=("CAM-4",), kind="fault", stage=Stage.RAY)
def fault_not_normalised(frame: Any, sx: Any, sy: Any) -> Any:
    """Return p - eye, not a unit vector."""
    return frame.forward + sx * frame.right * frame.horizontal + sy * frame.up * frame.vertical
