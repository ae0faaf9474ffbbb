"""Control: a ray by the product of both inverse matrices, multiplied out first and divided by w.

The ray turns by about u abs(eye) / near, and from far / near = 2 / u on w is 0 and no ray is left.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.numerics.matrices import quad


@CAMERA.register(
    "ray/matrix_w_divide",
    covers=("CAM-5",),
    kind="control",
    stage=Stage.RAY,
    known_bad="w cancels like far / near; the ray turns by u abs(eye) / near, and dies at far / near = 2 / u",
)
def matrix_w_divide(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(P / w - eye) with (P, w) = (View^-1 Proj^-1) (sx, sy, 1, 1)."""
    P = (frame.view_inverse @ frame.projection_inverse) @ quad(sx, sy, 1, 1)
    return dr.normalize(P.xyz / P.w - frame.eye)
