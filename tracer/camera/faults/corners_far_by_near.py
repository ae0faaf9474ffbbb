"""Planted fault: the far plane's corners no farther from the axis than the near plane's."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register(
    "corners/fault_far_by_near",
    covers=("CAM-2",),
    kind="fault",
    says="takes a box for the camera's frustum, its far corners as wide as its near ones",
    stage=Stage.CAMERA,
)
def fault_far_by_near(frame: Any) -> list[Any]:
    """Return the corners of a box instead of a frustum."""
    return [
        frame.eye
        + depth * frame.forward
        + frame.near * (sx * frame.horizontal * frame.right + sy * frame.vertical * frame.up)
        for depth in (frame.near, frame.far)
        for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
