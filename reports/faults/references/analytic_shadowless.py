"""Planted fault: analytic's feelers meet nothing."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reference.analytic import feelers
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/analytic_shadowless",
    where="reference",
    stage=Stage.VISIBILITY,
    who=("analytic",),
    cases=(
        "shadows/*",
        "several_lights/*",
    ),
)
@contextmanager
def analytic_shadowless() -> Iterator[None]:
    """Let no shape block a light."""
    right = feelers.blocked

    def wrong(scene: Any, index: int, source: Any, objects: Any, positions: Any) -> Any:
        return np.zeros(len(objects), dtype=bool)

    with replaced(right, wrong):
        yield
