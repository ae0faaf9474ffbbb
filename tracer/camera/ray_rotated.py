"""A ray by the inverse projection, turned by the 3x3 part of the inverse view: the eye is never added, and w not used.

In camera space a wrong w only makes the ray longer or shorter.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.numerics.matrices import quad


@CAMERA.register("ray/rotated", covers=("CAM-5",), kind="right", stage=Stage.RAY)
def rotated(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(R P) with P = Proj^-1 (sx, sy, 1, 1) and R the rotation in View^-1."""
    P = frame.projection_inverse @ quad(sx, sy, 1, 1)
    return dr.normalize((frame.view_inverse @ quad(P.x, P.y, P.z, 0)).xyz)
