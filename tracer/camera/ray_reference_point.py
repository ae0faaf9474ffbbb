"""A ray by the reference point: a point of the image plane through it, minus the eye."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.numerics.unit_vectors import normalized


@CAMERA.register("ray/reference_point", covers=("CAM-4",), kind="right", stage=Stage.RAY, default=True)
def reference_point(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(p - eye) with p = ref + sx H + sy V."""
    # Any t > 0 gives the same ray. One as large as the eye's coordinates keeps p - eye from cancelling.
    t = dr.maximum(dr.norm(frame.target - frame.eye), dr.maximum(dr.max(abs(frame.eye)), 2.0**-50))
    ref = dr.fma(frame.forward, t, frame.eye)
    length = dr.norm(ref - frame.eye)
    V = frame.up * (length * frame.vertical)
    H = frame.right * (length * frame.horizontal)
    p = dr.fma(sx, H, dr.fma(sy, V, ref))
    return normalized(p - frame.eye)
