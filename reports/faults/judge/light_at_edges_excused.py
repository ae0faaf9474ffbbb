"""Planted fault: at an edge light may have any value, not only that of a side."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered
from rayproof.reports.judge.bench import Bench
from rayproof.reports.judge.light_sides import Held


@FAULTS.register("judge/light_at_edges_excused", where="judge", stage=None)
@contextmanager
def light_at_edges_excused() -> Iterator[None]:
    """Excuse the light of every edge pixel."""

    def wrong(bench: Any, stage: Any, where: Any) -> Held:
        return Held(good=where, interval=np.zeros_like(where))

    with altered(Bench, "_lit", wrong):
        yield
