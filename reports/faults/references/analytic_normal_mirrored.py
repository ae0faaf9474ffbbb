"""Planted fault: analytic's normals point inwards."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.analytic import surfaces
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/analytic_normal_mirrored",
    where="reference",
    stage=Stage.NORMAL,
    who=("analytic",),
    cases=(
        "primitives/*",
        "transforms/*_mirrored",
        "transforms/sphere_*",
    ),
)
@contextmanager
def analytic_normal_mirrored() -> Iterator[None]:
    """Turn the analytic normals round."""
    right = surfaces.outward_normals

    def wrong(*arguments: Any) -> Any:
        return -right(*arguments)

    with replaced(right, wrong):
        yield
