"""Planted fault: analytic samples the pixels' corners."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.scene import Camera
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import views
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/analytic_pixel_corner",
    where="reference",
    stage=Stage.CAMERA,
    who=("analytic",),
    also=(Stage.RAY,),
    cases=(
        "cameras/*",
        "primitives/*",
    ),
)
@contextmanager
def analytic_pixel_corner() -> Iterator[None]:
    """Shift the analytic pixel centres by half a pixel."""
    right = views.pixel_centers

    def wrong(camera: Camera) -> Any:
        return right(camera) - 0.5

    with replaced(right, wrong):
        yield
