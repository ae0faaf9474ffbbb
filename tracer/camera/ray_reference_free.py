"""A ray by the reference point with the eye left out: it is neither added nor taken off again.

Rounding is then relative to the direction itself, wherever the eye stands.
"""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register("ray/reference_free", covers=("CAM-4",), kind="right", stage=Stage.RAY)
def reference_free(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(F + sx R aspect tan(alpha) + sy U tan(alpha))."""
    H, V = frame.right * frame.horizontal, frame.up * frame.vertical
    return dr.normalize(frame.forward + sx * H + sy * V)
