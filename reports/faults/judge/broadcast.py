"""Planted fault: images of different size are broadcast."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import measurement, shapes_of_answers


@FAULTS.register("judge/broadcast", where="judge", stage=None)
@contextmanager
def broadcast() -> Iterator[None]:
    """Stretch an image of one row over all."""
    right, misshapen = measurement.measure, shapes_of_answers.misshapen

    def measure(stage: Any, ours: Any, theirs: Any, *rest: Any, **options: Any) -> Any:
        return right(stage, np.broadcast_to(ours, theirs.shape), theirs, *rest, **options)

    def none(*arguments: Any) -> dict[Any, str]:
        return {}

    with replaced(right, measure), replaced(misshapen, none):
        yield
