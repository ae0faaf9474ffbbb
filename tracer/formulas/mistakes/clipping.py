"""Planted mistakes of `formulas/clipping`; a run that uses one says so, and none is used unless it is named."""

from typing import Any

import drjit as dr


def fault_far_ignored(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the near plane's t [m] and inf.

    Nothing is ever too far away.
    """
    return near / dr.dot(direction, forward), type(near)(dr.inf)


def fault_far_off(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the t [m] of the near plane, and of one at 1 - 1e-6 of the far plane's depth.

    The far plane a millionth too near.
    """
    per_depth = 1 / dr.dot(direction, forward)
    return near * per_depth, far * (1 - 1e-6) * per_depth


def fault_near_ignored(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return 0 and the far plane's t [m].

    Everything in front of the eye counts, up to the far plane.
    """
    return type(near)(0), far / dr.dot(direction, forward)


def fault_behind(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return -inf and inf.

    Negative t accepted: what is behind the eye is seen.
    """
    return type(near)(-dr.inf), type(near)(dr.inf)


def fault_planes(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the t [m] of the frustum's planes.

    Planes where the scene asks for a shell.
    """
    cosine = dr.dot(direction, forward)
    return near / cosine, far / cosine
