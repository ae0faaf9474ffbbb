"""Planted fault: Mitsuba's samples are scattered over the pixel."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.mitsuba3 import worlds
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/mitsuba_jittered",
    where="reference",
    stage=Stage.RADIANCE,
    who=(
        "mitsuba_llvm",
        "mitsuba_scalar",
    ),
    cases=(
        "primitives/*",
        "several_lights/*",
        "shadows/*",
    ),
)
@contextmanager
def mitsuba_jittered() -> Iterator[None]:
    """Jitter the samples of Mitsuba's images."""
    right = worlds.sensor

    def wrong(*arguments: Any, **options: Any) -> dict[str, Any]:
        sensor = right(*arguments, **options)
        return sensor | {"sampler": sensor["sampler"] | {"jitter": True}}

    with replaced(right, wrong):
        yield
