"""Planted fault: Mitsuba is handed mirrored and stretched shapes as they are, which it draws wrong."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.mitsuba3 import shapes
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/mitsuba_no_instances",
    where="reference",
    stage=Stage.NORMAL,
    who=(
        "mitsuba_llvm",
        "mitsuba_scalar",
    ),
    also=(
        Stage.OBJECT,
        Stage.DISTANCE,
        Stage.POSITION,
    ),
    cases=(
        "transforms/*_mirrored",
        "transforms/sphere_*",
        "normals/*",
    ),
)
@contextmanager
def mitsuba_no_instances() -> Iterator[None]:
    """Never wrap a shape in an instance."""
    right = shapes.needs_instance

    def wrong(shape: Any) -> bool:
        return False

    with replaced(right, wrong):
        yield
