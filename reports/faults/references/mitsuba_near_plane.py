"""Planted fault: Mitsuba's distances are measured from the near plane."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.mitsuba3 import stages
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/mitsuba_near_plane",
    where="reference",
    stage=Stage.DISTANCE,
    who=(
        "mitsuba_llvm",
        "mitsuba_scalar",
    ),
    cases=(
        "primitives/*",
        "clipping/*",
    ),
)
@contextmanager
def mitsuba_near_plane() -> Iterator[None]:
    """Take the near plane's depth off Mitsuba's distances."""
    right = stages.answers

    def wrong(scene: Any, *rest: Any) -> Any:
        found = right(scene, *rest)
        if Stage.DISTANCE in found:
            found[Stage.DISTANCE] = found[Stage.DISTANCE] - scene.camera.near
        return found

    with replaced(right, wrong):
        yield
