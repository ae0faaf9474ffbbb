"""Control: a ray by the product of both inverse matrices with the projection's inverse in closed form, divided by w.

The closed form changes nothing: the digits go in the product (see `ray/matrix_w_divide`).
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.numerics.matrices import matrix, quad


@CAMERA.register(
    "ray/analytic_inverse",
    covers=("CAM-5",),
    kind="control",
    stage=Stage.RAY,
    known_bad="w cancels like far / near in the product; the ray turns by u abs(eye) / near, and dies at 2 / u",
)
def analytic_inverse(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(P / w - eye) with (P, w) = (View^-1 Proj^-1) (sx, sy, 1, 1)."""
    near, far = frame.near, frame.far
    projection_inverse = matrix(
        [
            [frame.horizontal, 0, 0, 0],
            [0, frame.vertical, 0, 0],
            [0, 0, 0, 1],
            [0, 0, (near - far) / (near * far), 1 / near],
        ],
        like=near,
    )
    P = (frame.view_inverse @ projection_inverse) @ quad(sx, sy, 1, 1)
    return dr.normalize(P.xyz / P.w - frame.eye)
