"""Planted fault: analytic spreads the flux over 2 pi."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.analytic import light
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/analytic_flux_factor",
    where="reference",
    stage=Stage.IRRADIANCE,
    who=("analytic",),
    cases=(
        "primitives/*",
        "several_lights/*",
        "shadows/*",
    ),
)
@contextmanager
def analytic_flux_factor() -> Iterator[None]:
    """Double the analytic irradiance."""
    right = light.irradiance

    def wrong(*arguments: Any) -> Any:
        return 2 * right(*arguments)

    with replaced(right, wrong):
        yield
