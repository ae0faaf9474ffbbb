"""Planted fault: the transpose taken for the inverse, as if every matrix were a rotation."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register(
    "inverse/fault_transposed",
    covers=("CAM-1", "CAM-2"),
    kind="fault",
    says="transposes the camera's matrices where it has to invert them",
    stage=Stage.CAMERA,
)
def fault_transposed(matrix: Any) -> Any:
    """Return the transpose of a 4x4 matrix."""
    return type(matrix)([[matrix[j, i] for j in range(4)] for i in range(4)])
