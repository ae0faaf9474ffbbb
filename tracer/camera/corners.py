"""The corners of the frustum."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA

ORDER = ((-1, -1), (1, -1), (1, 1), (-1, 1))  # (sx, sy)


@CAMERA.register("corners/axes", covers=("CAM-2",), kind="right", stage=Stage.CAMERA, default=True)
def corners(frame: Any) -> list[Any]:
    """Return the eight corners in world space [m], near plane first, each plane in the order of `ORDER`."""
    return [
        frame.eye + depth * (frame.forward + sx * frame.horizontal * frame.right + sy * frame.vertical * frame.up)
        for depth in (frame.near, frame.far)
        for sx, sy in ORDER
    ]
