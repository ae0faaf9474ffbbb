"""From pixels to normalised device coordinates."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("ndc/up", covers=("CAM-3",), kind="right", stage=Stage.CAMERA, default=True)
def ndc(px: Any, py: Any, width: int, height: int) -> tuple[Any, Any]:
    """Return sx = 2 px / W - 1 to the right and sy = 1 - 2 py / H upwards."""
    return 2 * px / width - 1, 1 - 2 * py / height
