"""The perspective projection matrix."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.numerics.matrices import matrix


@CAMERA.register("projection/zero_to_one", covers=("CAM-2",), kind="right", stage=Stage.CAMERA, default=True)
def projection(horizontal: Any, vertical: Any, near: Any, far: Any) -> Any:
    """Return camera -> clip with w = depth; after the division by w depth near goes to 0 and far to 1."""
    stretch = far / (far - near)
    return matrix(
        [
            [1 / horizontal, 0, 0, 0],
            [0, 1 / vertical, 0, 0],
            [0, 0, stretch, -near * stretch],
            [0, 0, 1, 0],
        ],
        like=near,
    )
