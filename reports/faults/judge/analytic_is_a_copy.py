"""Planted fault: analytic's images are replaced by copies of the tracer's."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered


@FAULTS.register(
    "judge/analytic_is_a_copy",
    where="judge",
    stage=Stage.RAY,
    who=("analytic",),
    cases=(
        "primitives/*",
        "several_lights/*",
        "shadows/*",
    ),
)
@contextmanager
def analytic_is_a_copy() -> Iterator[None]:
    """Let analytic answer with the tracer's own answers."""

    def wrong(self: Any, scene: Any, stages: Any, *, samples: int = 1) -> Any:
        from rayproof.tracer.configuration import Configuration
        from rayproof.tracer.render import render

        return render(scene, stages, Configuration(precision="float32"), samples=samples)

    with altered(Analytic, "render", wrong):
        yield
