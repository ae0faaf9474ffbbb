"""Planted faults of lights: in a loop and unrolled, with and without feelers, and of scenes without any."""

from typing import Any

from rayproof.cases.scene import Mesh
from rayproof.cases.stages import Stage
from rayproof.reports.audit.faults.tracer.planting import function, method
from rayproof.tracer.shapes.shape import TracedShape
from rayproof.tracer.stages import illumination, light_loop, trace
from rayproof.tracer.stages.intersector import World

SIXTH = 6


def _dimmed(right: Any, world: Any, name: str, values: Any) -> Any:
    lost = [(0.0, 0.0, 0.0)] * (len(values) - SIXTH)
    return right(world, name, [*values[:SIXTH], *lost] if name == "fluxes" else values)


def _less(right: Any, *given: Any) -> Any:
    return [one * (1 - 2.0**-10) for one in right(*given)]


def _brighter(right: Any, world: Any, index: int, what: str, value: Any) -> Any:
    wrong = tuple(1.01 * one for one in value) if what == "flux" and index else value
    return right(world, index, what, wrong)


def _dark(right: Any, origins: Any, surfaces: Any, towards: Any, above: Any) -> Any:
    free = right(origins, surfaces, towards, above)
    return free if origins else [one & (way.cosine > 0.9) for one, way in zip(free, towards, strict=True)]


def _glowing(right: Any, trace: Any) -> Any:
    return right(trace) | {Stage.RADIANCE: [trace.world.types.Vector(0.001)] * trace.view.lanes.tile}


def _never(right: Any, shape: Any) -> bool:
    return False


def _alone(right: Any, one: Any) -> bool:
    return len(one.scene.shapes) > 1 or (not isinstance(one.scene.shapes[0], Mesh) and right(one))


def _brighter_in(precision: str) -> Any:
    def brought(right: Any, world: Any, flux: Any, towards: Any) -> Any:
        found = right(world, flux, towards)
        return found * (1 + 2.0**-10) if world.types.precision == precision else found

    return brought


function(
    "lights_after_the_sixth",
    light_loop._numbers,
    _dimmed,
    "The loop's lights after the sixth bring nothing.",
    path="lights/in turn",
    stage=Stage.IRRADIANCE,
    cases=("several_lights/eight",),
)
function(
    "sum_in_turn",
    light_loop._loop,
    _less,
    "The loop's sum is a thousandth too small.",
    path="lights/in turn",
    stage=Stage.IRRADIANCE,
    cases=("several_lights/eight",),
)
function(
    "second_light_brighter",
    illumination._of_light,
    _brighter,
    "Every unrolled light but the first too bright.",
    path="lights/unrolled",
    stage=Stage.IRRADIANCE,
    cases=("several_lights/inverse_square",),
)
function(
    "lone_body_darkened",
    illumination._unblocked,
    _dark,
    "Where nothing can block, light that slants is lost.",
    path="feelers/none",
    stage=Stage.VISIBILITY,
    cases=("primitives/sphere", "primitives/square"),
)
function(
    "glow_without_light",
    trace._darkness,
    _glowing,
    "A scene without a light sends some out.",
    path="lights/none",
    stage=Stage.RADIANCE,
    cases=("clipping/faces_none",),
    routes=("numbers", "frames"),
)
method(
    "two_sided_body_alone",
    TracedShape,
    "can_shadow_itself",
    _never,
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
    function(
        f"light_in_{_precision}",
        illumination._brought,
        _brighter_in(_precision),
        f"In {_precision} every light is a thousandth too bright.",
        path=f"precision/{_precision}",
        stage=Stage.IRRADIANCE,
        cases=("primitives/square",),
        precision=_precision,
    )
