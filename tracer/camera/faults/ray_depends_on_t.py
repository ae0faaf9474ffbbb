"""Planted fault: H and V without the length of the reference vector, so that the ray depends on t."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA


@CAMERA.register(
    "ray/fault_depends_on_t",
    covers=("CAM-4",),
    kind="fault",
    says="builds rays that are right only for a target 1 m away",
    stage=Stage.RAY,
)
def fault_depends_on_t(frame: Any, sx: Any, sy: Any) -> Any:
    """Return a ray that is right only for a target 1 m away."""
    t = dr.norm(frame.target - frame.eye)
    ref = dr.fma(frame.forward, t, frame.eye)
    p = ref + sx * frame.right * frame.horizontal + sy * frame.up * frame.vertical
    return dr.normalize(p - frame.eye)
