"""Planted fault: Mitsuba's normals are read inwards."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.mitsuba3 import stages
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/mitsuba_normal_mirrored",
    where="reference",
    stage=Stage.NORMAL,
    who=(
        "mitsuba_llvm",
        "mitsuba_scalar",
    ),
    cases=(
        "primitives/*",
        "transforms/*",
    ),
)
@contextmanager
def mitsuba_normal_mirrored() -> Iterator[None]:
    """Turn Mitsuba's normals round."""
    right = stages._shading_normals

    def wrong(scene: Any, hits: Any) -> Any:
        return -right(scene, hits)

    with replaced(right, wrong):
        yield
