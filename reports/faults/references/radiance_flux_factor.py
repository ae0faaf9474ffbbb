"""Planted fault: Radiance's light is read as that of half a watt."""

from collections.abc import Iterator
from contextlib import contextmanager

from rayproof.cases.stages import Stage
from rayproof.reference.radiance.tracing import World
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered


@FAULTS.register(
    "reference/radiance_flux_factor",
    where="reference",
    stage=Stage.IRRADIANCE,
    who=("radiance",),
    cases=(
        "primitives/*",
        "several_lights/*",
    ),
)
@contextmanager
def radiance_flux_factor() -> Iterator[None]:
    """Double what rtrace answers."""
    right = World.per_watt

    with altered(World, "per_watt", property(lambda world: 2 * right.__get__(world))):
        yield
