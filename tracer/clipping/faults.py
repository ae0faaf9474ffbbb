"""Planted faults of the clipping formulas, for the audit; never in use unless named."""

from typing import Any

import drjit as dr

from rayproof.cases.stages import Stage
from rayproof.tracer.clipping import CLIPPING


@CLIPPING.register("clip_depth/fault_far_ignored", covers=("HIT-2",), kind="fault", stage=Stage.OBJECT)
def fault_far_ignored(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the near plane's t [m] and inf.

    Nothing is ever too far away.
    """
    return near / dr.dot(direction, forward), type(near)(dr.inf)


@CLIPPING.register(
    "clip_depth/fault_far_off",
    covers=("HIT-2",),
    kind="fault",
    says="clips a millionth of the depth before the far plane",
    stage=Stage.OBJECT,
    cases=("walls/far",),
)
def fault_far_off(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the t [m] of the near plane, and of one at 1 - 1e-6 of the far plane's depth.

    The far plane a millionth too near.
    """
    per_depth = 1 / dr.dot(direction, forward)
    return near * per_depth, far * (1 - 1e-6) * per_depth


@CLIPPING.register("clip_depth/fault_near_ignored", covers=("HIT-2",), kind="fault", stage=Stage.OBJECT)
def fault_near_ignored(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return 0 and the far plane's t [m].

    Everything in front of the eye counts, up to the far plane.
    """
    return type(near)(0), far / dr.dot(direction, forward)


@CLIPPING.register(
    "clip_none/fault_behind",
    covers=("HIT-2",),
    kind="fault",
    cases=("behind/*",),
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
)
def fault_behind(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return -inf and inf.

    Negative t accepted: what is behind the eye is seen.
    """
    return type(near)(-dr.inf), type(near)(dr.inf)


@CLIPPING.register(
    "clip_shell/fault_planes", covers=("HIT-2",), kind="fault", cases=("clipping/*_shell",), stage=Stage.OBJECT
)
def fault_planes(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the t [m] of the frustum's planes.

    Planes where the scene asks for a shell.
    """
    cosine = dr.dot(direction, forward)
    return near / cosine, far / cosine
