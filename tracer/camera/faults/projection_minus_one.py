"""Planted fault: depth from -1 at the near plane, as OpenGL has it."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.matrices import matrix


@CAMERA.register(
    "projection/fault_minus_one",
    covers=("CAM-2",),
    kind="fault",
    says="projects depths to -1 to 1 instead of 0 to 1",
    stage=Stage.CAMERA,
)
def fault_minus_one(horizontal: Any, vertical: Any, near: Any, far: Any) -> Any:
    """Return camera -> clip with near -> -1 and far -> 1."""
    stretch = (far + near) / (far - near)
    return matrix(
        [
            [1 / horizontal, 0, 0, 0],
            [0, 1 / vertical, 0, 0],
            [0, 0, stretch, -2 * near * far / (far - near)],
            [0, 0, 1, 0],
        ],
        like=near,
    )
