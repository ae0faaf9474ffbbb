"""Planted fault: analytic leaves the last of several lights out."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import light
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/analytic_light_dropped",
    where="reference",
    stage=Stage.IRRADIANCE,
    who=("analytic",),
    cases=(
        "several_lights/*",
        "simplified/*",
        "invariance/*",
    ),
)
@contextmanager
def analytic_light_dropped() -> Iterator[None]:
    """Sum all lights but the last."""
    right = light.irradiance

    def wrong(scene: Scene, positions: Any, normals: Any, visible: Any) -> Any:
        fewer = replace(scene, lights=scene.lights[: max(1, len(scene.lights) - 1)])
        return right(fewer, positions, normals, visible)

    with replaced(right, wrong):
        yield
