"""Planted fault: the edge class swallows a whole object."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import classes


@FAULTS.register("judge/edge_swallows_object", where="judge", stage=None)
@contextmanager
def edge_swallows_object() -> Iterator[None]:
    """Class every pixel of the first shape as an outline."""
    right = classes.classify

    def wrong(scene: Any, truth: Any, *rest: Any, **options: Any) -> Any:
        found = right(scene, truth, *rest, **options)
        return replace(found, outline=found.outline | (truth[Stage.OBJECT][..., 0] == 0))

    with replaced(right, wrong):
        yield
