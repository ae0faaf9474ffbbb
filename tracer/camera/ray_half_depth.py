"""Control for erratum E14: pixel Z "arbitrary in (0, 1]", without a division by w."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.numerics.matrices import quad


@CAMERA.register(
    "ray/half_depth",
    covers=("CAM-5",),
    kind="control",
    says="forgets to divide by w where it brings a point at half depth back from clip space",
    stage=Stage.RAY,
    erratum="E14",
)
def half_depth(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(P - eye) with P = View^-1 Proj^-1 ((sx, sy, 0.5, 1) far), whose w is not 1."""
    far = frame.far
    P = frame.view_inverse @ (frame.projection_inverse @ quad(sx * far, sy * far, far * 0.5, far))
    return dr.normalize(P.xyz - frame.eye)
