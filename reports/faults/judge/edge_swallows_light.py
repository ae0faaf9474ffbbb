"""Planted fault: every lit pixel is classed as a shadow's edge."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced
from rayproof.reports.judge import classes


@FAULTS.register("judge/edge_swallows_light", where="judge", stage=None)
@contextmanager
def edge_swallows_light() -> Iterator[None]:
    """Class every pixel as undecided for every light."""
    right = classes.classify

    def wrong(*arguments: Any, **options: Any) -> Any:
        found = right(*arguments, **options)
        return replace(found, light=found.light | True)

    with replaced(right, wrong):
        yield
