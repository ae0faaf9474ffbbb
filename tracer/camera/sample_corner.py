"""Control for erratum E1: pixel coordinates without saying corner or centre."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("sample/corner", covers=("CAM-3",), kind="control", stage=Stage.CAMERA, erratum="E1")
def corner(column: Any, row: Any, per_side: int) -> tuple[Any, Any]:
    """Return the sample's top-left corner, which shifts every image by half a sample."""
    return column / per_side, row / per_side
