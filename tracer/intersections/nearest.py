"""The nearest hit over all geometry."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.intersections import INTERSECTIONS


@INTERSECTIONS.register("nearest/smaller", covers=("HIT-9",), kind="right", stage=Stage.OBJECT, default=True)
def smaller(distance: Any, best: Any) -> Any:
    """Return where `distance` is smaller than `best`; at a tie the shape asked first keeps it."""
    return distance < best
