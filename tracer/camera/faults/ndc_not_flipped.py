"""Planted fault: rows counted upwards, so the image stands on its head."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("ndc/fault_not_flipped", covers=("CAM-3",), kind="fault", stage=Stage.CAMERA, also=(Stage.RAY,))
def fault_not_flipped(px: Any, py: Any, width: int, height: int) -> tuple[Any, Any]:
    """Return sy = 2 py / H - 1, growing downwards."""
    return 2 * px / width - 1, 2 * py / height - 1
