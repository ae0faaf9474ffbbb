"""Planted fault: Embree's feelers go on past the light."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reference.embree.tracing import World
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered


@FAULTS.register(
    "reference/embree_past_the_light",
    where="reference",
    stage=Stage.VISIBILITY,
    who=("embree",),
    cases=("flux_conservation/*",),
)
@contextmanager
def embree_past_the_light() -> Iterator[None]:
    """Stretch the feelers tenfold."""
    right = World.blocked

    def wrong(world: World, origin: np.ndarray, target: np.ndarray, least: np.ndarray) -> np.ndarray:
        return right(world, origin, origin + 10 * (target - origin), least)

    with altered(World, "blocked", wrong):
        yield
