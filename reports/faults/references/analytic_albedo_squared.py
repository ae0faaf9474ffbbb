"""Planted fault: analytic applies the albedo twice."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.analytic import light
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/analytic_albedo_squared",
    where="reference",
    stage=Stage.EXITANCE,
    who=("analytic",),
    cases=(
        "primitives/*",
        "several_lights/*",
        "shadows/*",
    ),
)
@contextmanager
def analytic_albedo_squared() -> Iterator[None]:
    """Multiply the exitance by the irradiance's colour once more."""
    right = light.exitance

    def wrong(scene: Any, objects: Any, arriving: Any) -> Any:
        return right(scene, objects, right(scene, objects, arriving))

    with replaced(right, wrong):
        yield
