"""Planted fault: Mitsuba's irradiance alone is replaced by a copy of the tracer's."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reference.mitsuba3.references import _Mitsuba
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered


@FAULTS.register(
    "judge/mitsuba_copies_light",
    where="judge",
    stage=Stage.IRRADIANCE,
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
def mitsuba_copies_light() -> Iterator[None]:
    """Let Mitsuba answer irradiance with the tracer's own image."""
    right = vars(_Mitsuba)["render"]

    def wrong(self: Any, scene: Any, stages: Any, *, samples: int = 1) -> Any:
        from rayproof.tracer.configuration import Configuration
        from rayproof.tracer.render import render

        found = right(self, scene, stages, samples=samples)
        if Stage.IRRADIANCE in found:
            found |= render(scene, (Stage.IRRADIANCE,), Configuration(precision="float32"))
        return found

    with altered(_Mitsuba, "render", wrong):
        yield
