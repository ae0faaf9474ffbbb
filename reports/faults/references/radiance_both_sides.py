"""Planted fault: Radiance's surfaces are all two-sided."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.radiance import materials
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered


@FAULTS.register(
    "reference/radiance_both_sides",
    where="reference",
    stage=Stage.RADIANCE,
    who=("radiance",),
    cases=(
        "sidedness/*_from_the_viewer",
        "inside/one_sided_sphere",
    ),
)
@contextmanager
def radiance_both_sides() -> Iterator[None]:
    """Leave out the pattern that blackens one-sided surfaces from behind."""
    right = materials.painted

    def wrong(scene: Scene) -> list[str]:
        return right(replace(scene, shapes=tuple(replace(shape, two_sided=True) for shape in scene.shapes)))

    with altered(materials, "painted", wrong):
        yield
