"""Planted fault: analytic clips by distance where the scene says depth."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import nearest
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced


@FAULTS.register(
    "reference/analytic_shell",
    where="reference",
    stage=Stage.OBJECT,
    who=("analytic",),
    also=(Stage.DISTANCE,),
    cases=("clipping/*",),
)
@contextmanager
def analytic_shell() -> Iterator[None]:
    """Clip by spheres around the eye."""
    right = nearest.clip_interval

    def wrong(scene: Scene, directions: Any) -> Any:
        return right(replace(scene, clip="shell" if scene.clip == "depth" else scene.clip), directions)

    with replaced(right, wrong):
        yield
