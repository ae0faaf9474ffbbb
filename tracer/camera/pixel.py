"""From normalised device coordinates back to pixels."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("pixel/down", covers=("CAM-3",), kind="right", stage=Stage.CAMERA, default=True)
def pixel(sx: Any, sy: Any, width: int, height: int) -> tuple[Any, Any]:
    """Return px = (sx + 1) W / 2 and py = (1 - sy) H / 2."""
    return (sx + 1) * width / 2, (1 - sy) * height / 2
