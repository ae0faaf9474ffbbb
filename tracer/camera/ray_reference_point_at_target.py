"""A ray by the reference point at the target, which the eye is added to and taken off again.

Digits go with the eye's distance from the world's origin over its distance from the target.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("ray/reference_point_at_target", covers=("CAM-4",), kind="right", stage=Stage.RAY)
def reference_point_at_target(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(p - eye) with p = ref + sx H + sy V and ref = eye + abs(target - eye) F."""
    ref = frame.eye + frame.forward * dr.norm(frame.target - frame.eye)
    length = dr.norm(ref - frame.eye)
    V = frame.up * (length * frame.vertical)
    H = frame.right * (length * frame.horizontal)
    p = ref + sx * H + sy * V
    return dr.normalize(p - frame.eye)
