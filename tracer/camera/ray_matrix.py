"""Control: a ray by the product of both inverse matrices, multiplied out first and without a division by w.

The product's last row takes 1 / (2 near) twice and off again, so that w is 1 up to far / near roundings; in world space
w multiplies the eye, and the ray turns by about u abs(eye) / near.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.numerics.matrices import quad


@CAMERA.register(
    "ray/matrix",
    covers=("CAM-5",),
    kind="control",
    stage=Stage.RAY,
    known_bad="w is far (1 / 2 near - 1 / 2 near + ...), 1 up to far / near roundings, and multiplies the eye",
)
def matrix(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(P - eye) with P = (View^-1 Proj^-1) ((sx, sy, 1, 1) far)."""
    far = frame.far
    P = (frame.view_inverse @ frame.projection_inverse) @ quad(sx * far, sy * far, far, far)
    return dr.normalize(P.xyz - frame.eye)
