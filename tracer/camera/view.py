"""The view matrix."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.numerics.matrices import matrix


@CAMERA.register("view/rows", covers=("CAM-1",), kind="right", stage=Stage.CAMERA, default=True)
def view(eye: Any, right: Any, up: Any, forward: Any) -> Any:
    """Return world -> camera [m]: the axes as rows, and the eye moved to the origin."""
    rows = [[*axis, -dr.dot(axis, eye)] for axis in (right, up, forward)]
    return matrix([*rows, [0, 0, 0, 1]], like=right.x)
