"""A ray by the inverse matrices: a point of the far plane taken back to world space, minus the eye."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.numerics.matrices import quad


@CAMERA.register("ray/inverse_matrices", covers=("CAM-5",), kind="right", stage=Stage.RAY)
def inverse_matrices(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(P - eye) with P = View^-1 Proj^-1 ((sx, sy, 1, 1) far)."""
    far = frame.far
    camera = frame.projection_inverse @ quad(sx * far, sy * far, far, far)
    # On the far plane w comes out as 1 up to far / near roundings, which would multiply the eye: say that it is 1.
    P = frame.view_inverse @ quad(camera.x, camera.y, camera.z, 1)
    return dr.normalize(P.xyz - frame.eye)
