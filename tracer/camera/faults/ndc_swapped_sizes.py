"""Planted fault: width and height exchanged in the pixel's coordinates."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register(
    "ndc/fault_swapped_sizes",
    covers=("CAM-3",),
    kind="fault",
    says="swaps width and height where it turns pixels into image coordinates",
    stage=Stage.CAMERA,
)
def fault_swapped_sizes(px: Any, py: Any, width: int, height: int) -> tuple[Any, Any]:
    """Return sx = 2 px / H - 1 and sy = 1 - 2 py / W."""
    return 2 * px / height - 1, 1 - 2 * py / width
