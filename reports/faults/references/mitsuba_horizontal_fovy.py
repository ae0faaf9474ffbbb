"""Planted fault: Mitsuba's angle is taken along the image's width."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.mitsuba3 import worlds
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/mitsuba_horizontal_fovy",
    where="reference",
    stage=Stage.CAMERA,
    who=(
        "mitsuba_llvm",
        "mitsuba_scalar",
    ),
    also=(Stage.RAY,),
    cases=(
        "cameras/*",
        "primitives/*",
    ),
)
@contextmanager
def mitsuba_horizontal_fovy() -> Iterator[None]:
    """Measure Mitsuba's angle along x."""
    right = worlds.sensor

    def wrong(*arguments: Any, **options: Any) -> dict[str, Any]:
        return right(*arguments, **options) | {"fov_axis": "x"}

    with replaced(right, wrong):
        yield
