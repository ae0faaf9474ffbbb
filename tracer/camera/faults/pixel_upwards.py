"""Planted fault: the way back from NDC forgets that rows count downwards."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register(
    "pixel/fault_upwards",
    covers=("CAM-3",),
    kind="fault",
    says="counts pixel rows from the bottom where it turns image coordinates into pixels",
    stage=Stage.CAMERA,
)
def fault_upwards(sx: Any, sy: Any, width: int, height: int) -> tuple[Any, Any]:
    """Return py = (1 + sy) H / 2."""
    return (sx + 1) * width / 2, (1 + sy) * height / 2
