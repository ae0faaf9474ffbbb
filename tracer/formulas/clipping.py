"""Which part of a camera ray counts. The scene's `clip` chooses the slot."""

from typing import Any

import drjit as dr


def planes(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return the t [m] of the two planes: near < t dot(d, F) < far.

    Clipping by the frustum's near and far planes.
    """
    cosine = dr.dot(direction, forward)
    per_depth = 1 / cosine
    return near * per_depth, far * per_depth


def shell(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return near and far [m] themselves, a spherical shell around the eye.

    Control for erratum E2: near_clip < t < far_clip for the frustum's planes.
    """
    return near, far


def distance(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return near and far [m]: near < t < far.

    The lecture's clipping by distance, where the scene asks for it.
    """
    return near, far


def in_front(direction: Any, forward: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return 0 and inf [m].

    No clipping: everything in front of the eye counts.
    """
    return type(near)(0), type(near)(dr.inf)
