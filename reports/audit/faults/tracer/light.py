"""Planted faults of lights: in a loop and unrolled, with and without feelers, and of scenes without any."""

from typing import Any

from rayproof.cases.scene import Mesh
from rayproof.cases.stages import Stage
from rayproof.reports.audit.faults.tracer.planting import function, method
from rayproof.tracer.stages import intersector
from rayproof.tracer.stages.illumination import Illumination
from rayproof.tracer.stages.intersector import World
from rayproof.tracer.stages.light_loop import LightLoop
from rayproof.tracer.stages.trace import Trace

SIXTH = 6


def _dimmed(right: Any, loop: Any, name: str, values: Any) -> Any:
    lost = [(0.0, 0.0, 0.0)] * (len(values) - SIXTH)
    return right(loop, name, [*values[:SIXTH], *lost] if name == "fluxes" else values)


def _less(right: Any, loop: Any, seen: Any) -> Any:
    return [one * (1 - 2.0**-10) for one in right(loop, seen)]


def _brighter(right: Any, light: Any, index: int, what: str, value: Any) -> Any:
    wrong = tuple(1.01 * one for one in value) if what == "flux" and index else value
    return right(light, index, what, wrong)


def _dark(right: Any, light: Any, towards: Any, above: Any) -> Any:
    free = right(light, towards, above)
    return (
        free if light.world.has_blockers else [one & (way.cosine > 0.9) for one, way in zip(free, towards, strict=True)]
    )


def _glowing(right: Any, trace: Any) -> Any:
    return [trace.types.Vector(0.001)] * trace.lanes.tile if trace._dark else right(trace)


def _flat_or_convex(right: Any, shape: Any) -> bool:
    return isinstance(shape, Mesh)


def _alone(right: Any, one: Any) -> bool:
    return len(one.scene.shapes) > 1 or (not isinstance(one.scene.shapes[0], Mesh) and right(one))


def _brighter_in(precision: str) -> Any:
    def brought(right: Any, light: Any, flux: Any, towards: Any) -> Any:
        found = right(light, flux, towards)
        return found * (1 + 2.0**-10) if light.types.precision == precision else found

    return brought


method(
    "lights_after_the_sixth",
    LightLoop,
    "_numbers",
    _dimmed,
    "The loop's lights after the sixth bring nothing.",
    path="lights/in turn",
    stage=Stage.IRRADIANCE,
    cases=("several_lights/eight",),
)
method(
    "sum_in_turn",
    LightLoop,
    "_loop",
    _less,
    "The loop's sum is a thousandth too small.",
    path="lights/in turn",
    stage=Stage.IRRADIANCE,
    cases=("several_lights/eight",),
)
method(
    "second_light_brighter",
    Illumination,
    "_of_light",
    _brighter,
    "Every unrolled light but the first too bright.",
    path="lights/unrolled",
    stage=Stage.IRRADIANCE,
    cases=("several_lights/inverse_square",),
)
method(
    "lone_body_darkened",
    Illumination,
    "_unblocked",
    _dark,
    "Where nothing can block, light that slants is lost.",
    path="feelers/none",
    stage=Stage.VISIBILITY,
    cases=("primitives/sphere", "primitives/square"),
)
method(
    "glow_without_light",
    Trace,
    "radiance",
    _glowing,
    "A scene without a light sends some out.",
    path="lights/none",
    stage=Stage.RADIANCE,
    cases=("clipping/faces_none",),
    routes=("numbers", "frames"),
)
function(
    "two_sided_body_alone",
    intersector.can_shadow_itself,
    _flat_or_convex,
    "A lone two-sided body never shades itself.",
    path="feelers/of a lone body",
    stage=Stage.VISIBILITY,
    cases=("alone/two_sided_*",),
)
method(
    "concave_mesh_alone",
    World,
    "has_blockers",
    _alone,
    "A lone mesh never shades itself.",
    path="feelers/of a lone body",
    stage=Stage.VISIBILITY,
    cases=("alone/concave_mesh",),
)
for _precision in ("float32", "float64"):
    method(
        f"light_in_{_precision}",
        Illumination,
        "_brought",
        _brighter_in(_precision),
        f"In {_precision} every light is a thousandth too bright.",
        path=f"precision/{_precision}",
        stage=Stage.IRRADIANCE,
        cases=("primitives/square",),
        precision=_precision,
    )
