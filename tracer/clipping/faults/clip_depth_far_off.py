"""Planted fault: the far plane a millionth too near."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.clipping import CLIPPING


@CLIPPING.register(
    "clip_depth/fault_far_off",
    covers=("HIT-2",),
    kind="fault",
    says="clips a millionth of the depth before the far plane",
    stage=Stage.OBJECT,
    cases=("walls/far",),
)
def fault_far_off(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the t [m] of the near plane, and of one at 1 - 1e-6 of the far plane's depth."""
    per_depth = 1 / dr.dot(direction, forward)
    return near * per_depth, far * (1 - 1e-6) * per_depth
