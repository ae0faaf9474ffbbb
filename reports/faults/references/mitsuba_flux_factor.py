"""Planted fault: Mitsuba is handed the flux over 2 pi as intensity."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.mitsuba3 import worlds
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/mitsuba_flux_factor",
    where="reference",
    stage=Stage.IRRADIANCE,
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
def mitsuba_flux_factor() -> Iterator[None]:
    """Double Mitsuba's intensity."""
    right = worlds.intensity

    def wrong(light: Any) -> list[float]:
        return [2 * channel for channel in right(light)]

    with replaced(right, wrong):
        yield
