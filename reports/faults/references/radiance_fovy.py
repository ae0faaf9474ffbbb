"""Planted fault: Radiance's vertical angle is a thousandth too large."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.cases.scene import Camera
from rayproof.cases.stages import Stage
from rayproof.reference.radiance import cameras
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/radiance_fovy",
    where="reference",
    stage=Stage.RAY,
    who=("radiance",),
    cases=(
        "cameras/*",
        "primitives/*",
    ),
)
@contextmanager
def radiance_fovy() -> Iterator[None]:
    """Widen the view that rtrace is handed."""
    right = cameras.view

    def wrong(camera: Camera) -> Any:
        return right(replace(camera, fovy=camera.fovy * 1.001))

    with replaced(right, wrong):
        yield
