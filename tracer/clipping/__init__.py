"""Clipping formulas: which part of a camera ray counts. The scene's `clip` chooses the slot.

Contract: "clip_depth/...", "clip_shell/...", "clip_none/..." with the facts listed in `tracer.camera`;

    (direction, forward, near, far) -> (nearest, farthest) t [m] along the unit direction, both exclusive.
"""

from collections.abc import Callable
from typing import Any

from rayproof.cases.declarations import DeclaredRegistry

CLIPPING: DeclaredRegistry[Callable[..., Any]] = DeclaredRegistry(
    "clipping formula", package="rayproof.tracer.clipping", name="CLIPPING"
)
