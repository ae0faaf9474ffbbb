"""Faults that live in one execution path of the tracer alone: how they are planted, and those of light.

A method is wrapped, or the trees are built anew while a builder is wrong.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import wraps
from typing import Any

from rayproof.cases.scene import Mesh
from rayproof.cases.stages import Stage
from rayproof.tracer import light_path
from rayproof.tracer.light_path import illumination
from rayproof.tracer.light_path.surfaces import DeviceScene
from rayproof.tracer.shapes.shape import TracedShape
from rayproof.tracer.trees import trees
from tests.harness.audit.faults import FAULTS, altered, replaced

Wrong = Callable[..., Any]  # what takes the right function or the right value first, then what that was given


def _forget_trees() -> None:
    trees.host_forest.cache_clear()
    trees.host_crowd.cache_clear()


@contextmanager
def anew(planting: AbstractContextManager[None]) -> Iterator[None]:
    """Plant something, and let no tree be kept from before or for afterwards."""
    _forget_trees()
    try:
        with planting:
            yield
    finally:
        _forget_trees()


def _register(
    name: str,
    plant: Callable[[], AbstractContextManager[None]],
    what: str,
    *,
    path: str,
    stage: Stage,
    cases: Sequence[str],
    routes: Sequence[str] = (),
    also: Sequence[Stage] = (),
    precision: str = "float32",
) -> None:
    @contextmanager
    def planted() -> Iterator[None]:
        with anew(plant()):
            yield

    planted.__doc__ = what
    FAULTS.register(
        f"path/{name}",
        where="tracer",
        stage=stage,
        also=tuple(also),
        cases=tuple(cases),
        path=path,
        routes=tuple(routes),
        precision=precision,
    )(planted)


def method(name: str, owner: type, called: str, wrong: Wrong, what: str, **about: Any) -> None:
    """Register a fault that calls `wrong(right, self, ...)` in place of a method, property or cached property."""
    right = vars(owner)[called]

    def plant() -> AbstractContextManager[None]:
        if isinstance(right, property):
            getter: Any = right.fget
            return altered(owner, called, property(lambda self: wrong(getter, self)))
        if hasattr(right, "func"):
            # A cached property keeps what it computed in the object; so must the wrong one.
            function = right.func

            def kept(self: Any) -> Any:
                if called not in self.__dict__:
                    self.__dict__[called] = wrong(function, self)
                return self.__dict__[called]

            return altered(owner, called, property(kept, lambda self, value: self.__dict__.__setitem__(called, value)))
        if isinstance(right, staticmethod):
            inner = right.__func__
            return altered(owner, called, staticmethod(lambda *given: wrong(inner, *given)))

        @wraps(right)
        def method_of(self: Any, *given: Any, **named: Any) -> Any:
            return wrong(right, self, *given, **named)

        return altered(owner, called, method_of)

    _register(name, plant, what, **about)


def function(name: str, right: Any, wrong: Wrong, what: str, **about: Any) -> None:
    """Register a fault that calls `wrong(right, ...)` in place of a function, wherever it was imported to."""

    def plant() -> AbstractContextManager[None]:
        return replaced(right, wraps(right)(lambda *given, **named: wrong(right, *given, **named)))

    _register(name, plant, what, **about)


# Planted faults of lights: in a loop and unrolled, with and without shadow rays, and of scenes without any.


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
    illumination._numbers,
    _dimmed,
    "The loop's lights after the sixth bring nothing.",
    path="lights/in turn",
    stage=Stage.IRRADIANCE,
    cases=("several_lights/eight",),
)
function(
    "sum_in_turn",
    illumination._loop,
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
    path="shadow_rays/none",
    stage=Stage.VISIBILITY,
    cases=("primitives/sphere", "primitives/square"),
)
function(
    "glow_without_light",
    light_path._darkness,
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
    path="shadow_rays/of a lone body",
    stage=Stage.VISIBILITY,
    cases=("alone/two_sided_*",),
)
method(
    "concave_mesh_alone",
    DeviceScene,
    "has_blockers",
    _alone,
    "A lone mesh never shades itself.",
    path="shadow_rays/of a lone body",
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
