"""Where in the image a pixel is sampled: at its centre, or at the centres of a regular subdivision."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("sample/centre", covers=("CAM-3",), kind="right", stage=Stage.CAMERA, default=True)
def centre(column: Any, row: Any, per_side: int) -> tuple[Any, Any]:
    """Return image coordinates (px, py) of a sample's centre; pixel (0, 0) reaches from 0 to 1."""
    return (column + 0.5) / per_side, (row + 0.5) / per_side
