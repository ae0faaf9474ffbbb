"""Planted fault: Mitsuba's one light is never put in the next one's place."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.mitsuba3 import worlds
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered


@FAULTS.register(
    "reference/mitsuba_light_not_moved",
    where="reference",
    stage=Stage.IRRADIANCE,
    who=(
        "mitsuba_llvm",
        "mitsuba_scalar",
    ),
    also=(Stage.VISIBILITY,),
    cases=(
        "several_lights/i*",
        "random_scenes/*",
        "invariance/*",
    ),
)
@contextmanager
def mitsuba_light_not_moved() -> Iterator[None]:
    """Keep Mitsuba's first light for all."""

    def wrong(world: Any, light: Any) -> None:
        return None

    with altered(worlds.World, "place", wrong):
        yield
