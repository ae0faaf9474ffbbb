"""A ray by the inverse matrices one after the other, divided by w between them, where a wrong w does no harm.

From far / near = 2 / u on w is 0 and no ray is left.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.numerics.matrices import quad


@CAMERA.register("ray/w_divided_in_view", covers=("CAM-5",), kind="right", stage=Stage.RAY)
def w_divided_in_view(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(View^-1 (P / w) - eye) with (P, w) = Proj^-1 (sx, sy, 1, 1)."""
    P = frame.projection_inverse @ quad(sx, sy, 1, 1)
    world = frame.view_inverse @ quad(P.x / P.w, P.y / P.w, P.z / P.w, 1)
    return dr.normalize(world.xyz - frame.eye)
