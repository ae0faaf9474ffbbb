"""Planted fault: analytic's vertical angle is a thousandth too large."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.cases.scene import Camera
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import views
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/analytic_fovy",
    where="reference",
    stage=Stage.RAY,
    who=("analytic",),
    also=(Stage.CAMERA,),
    cases=(
        "cameras/*",
        "primitives/*",
    ),
)
@contextmanager
def analytic_fovy() -> Iterator[None]:
    """Widen the analytic camera."""
    right = views.view_of

    def wrong(camera: Camera) -> Any:
        return right(replace(camera, fovy=camera.fovy * 1.001))

    with replaced(right, wrong):
        yield
