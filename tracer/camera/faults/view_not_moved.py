"""Planted fault: a view matrix that turns and does not move."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.matrices import matrix


@CAMERA.register(
    "view/fault_not_moved",
    covers=("CAM-1",),
    kind="fault",
    says="leaves the eye's translation out of the view matrix",
    stage=Stage.CAMERA,
)
def fault_not_moved(eye: Any, right: Any, up: Any, forward: Any) -> Any:
    """Return world -> camera without the eye's translation."""
    rows = [[*axis, 0] for axis in (right, up, forward)]
    return matrix([*rows, [0, 0, 0, 1]], like=right.x)
