"""The camera's axes."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.numerics.unit_vectors import unit


@CAMERA.register("basis/right_handed", covers=("CAM-1",), kind="right", stage=Stage.CAMERA, default=True)
def basis(eye: Any, target: Any, up: Any) -> tuple[Any, Any, Any]:
    """Return right F x U, up and forward F, unit and orthogonal."""
    forward = unit(target - eye)
    right = unit(dr.cross(forward, unit(up)))
    return right, dr.cross(right, forward), forward
