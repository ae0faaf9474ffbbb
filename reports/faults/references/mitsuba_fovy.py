"""Planted fault: Mitsuba's vertical angle is a thousandth too large."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.mitsuba3 import worlds
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/mitsuba_fovy",
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
def mitsuba_fovy() -> Iterator[None]:
    """Widen Mitsuba's camera."""
    right = worlds.sensor

    def wrong(*arguments: Any, **options: Any) -> dict[str, Any]:
        sensor = right(*arguments, **options)
        return sensor | {"fov": sensor["fov"] * 1.001}

    with replaced(right, wrong):
        yield
