"""Planted fault: Mitsuba's images are replaced by copies of the tracer's."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.mitsuba3.references import _Mitsuba
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered


@FAULTS.register(
    "judge/mitsuba_is_a_copy",
    where="judge",
    stage=Stage.RAY,
    who=(
        "mitsuba_llvm",
        "mitsuba_scalar",
    ),
    cases=(
        "primitives/*",
        "several_lights/*",
        "shadows/*",
    ),
)
@contextmanager
def mitsuba_is_a_copy() -> Iterator[None]:
    """Let Mitsuba answer with the tracer's own answers."""

    def wrong(self: Any, scene: Any, stages: Any, *, samples: int = 1) -> Any:
        from rayproof.tracer.configuration import Configuration
        from rayproof.tracer.render import render

        return render(scene, stages, Configuration(precision="float32"), samples=samples)

    with altered(_Mitsuba, "render", wrong):
        yield
