"""Planted faults of the references."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from rayproof.cases.scene import Camera, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic, camera
from rayproof.reference.mitsuba3 import program
from rayproof.reference.mitsuba3 import scene as mitsuba_scene
from rayproof.reference.radiance import scene as radiance_scene
from rayproof.reference.radiance.program import RtraceScene as RadianceWorld
from tests.harness.audit.faults import FAULTS, altered, replaced


@FAULTS.register(
    "reference/analytic_albedo_squared",
    where="reference",
    stage=Stage.EXITANCE,
    who=("analytic",),
    cases=("primitives/*", "several_lights/*", "shadows/*"),
)
@contextmanager
def analytic_albedo_squared() -> Iterator[None]:
    """Multiply the exitance by the irradiance's colour once more.

    Analytic applies the albedo twice.
    """
    right = Analytic.exitance

    def wrong(self: Analytic, scene: Any, objects: Any, arriving: Any) -> Any:
        return right(self, scene, objects, right(self, scene, objects, arriving))

    with altered(Analytic, "exitance", wrong):
        yield


@FAULTS.register(
    "reference/analytic_flux_factor",
    where="reference",
    stage=Stage.IRRADIANCE,
    who=("analytic",),
    cases=("primitives/*", "several_lights/*", "shadows/*"),
)
@contextmanager
def analytic_flux_factor() -> Iterator[None]:
    """Double the analytic irradiance.

    Analytic spreads the flux over 2 pi.
    """
    right = Analytic.irradiance_of

    def wrong(*arguments: Any) -> Any:
        return 2 * right(*arguments)

    with altered(Analytic, "irradiance_of", wrong):
        yield


@FAULTS.register(
    "reference/analytic_fovy",
    where="reference",
    stage=Stage.RAY,
    who=("analytic",),
    also=(Stage.CAMERA,),
    cases=("cameras/*", "primitives/*"),
)
@contextmanager
def analytic_fovy() -> Iterator[None]:
    """Widen the analytic camera.

    Analytic's vertical angle is a thousandth too large.
    """
    right = camera.view_of

    def wrong(camera: Camera) -> Any:
        return right(replace(camera, fovy=camera.fovy * 1.001))

    with replaced(right, wrong):
        yield


@FAULTS.register(
    "reference/analytic_light_dropped",
    where="reference",
    stage=Stage.IRRADIANCE,
    who=("analytic",),
    cases=("several_lights/*", "simplified/*", "invariance/*"),
)
@contextmanager
def analytic_light_dropped() -> Iterator[None]:
    """Sum all lights but the last.

    Analytic leaves the last of several lights out.
    """
    right = Analytic.irradiance

    def wrong(self: Analytic, scene: Scene, objects: Any, shares: Any, visible: Any) -> Any:
        fewer = replace(scene, lights=scene.lights[: max(1, len(scene.lights) - 1)])
        return right(self, fewer, objects, shares, visible)

    with altered(Analytic, "irradiance", wrong):
        yield


@FAULTS.register(
    "reference/analytic_normal_mirrored",
    where="reference",
    stage=Stage.NORMAL,
    who=("analytic",),
    cases=("primitives/*", "transforms/*_mirrored", "transforms/sphere_*"),
)
@contextmanager
def analytic_normal_mirrored() -> Iterator[None]:
    """Turn the analytic normals round.

    Analytic's normals point inwards.
    """
    right = Analytic.outward_normals

    def wrong(*arguments: Any) -> Any:
        return -right(*arguments)

    with altered(Analytic, "outward_normals", wrong):
        yield


@FAULTS.register(
    "reference/analytic_pixel_corner",
    where="reference",
    stage=Stage.CAMERA,
    who=("analytic",),
    also=(Stage.RAY,),
    cases=("cameras/*", "primitives/*"),
)
@contextmanager
def analytic_pixel_corner() -> Iterator[None]:
    """Shift the analytic pixel centres by half a pixel.

    Analytic samples the pixels' corners.
    """
    right = camera.pixel_centers

    def wrong(camera: Camera) -> Any:
        return right(camera) - 0.5

    with replaced(right, wrong):
        yield


@FAULTS.register(
    "reference/analytic_shadowless",
    where="reference",
    stage=Stage.VISIBILITY,
    who=("analytic",),
    cases=("shadows/*", "several_lights/*"),
)
@contextmanager
def analytic_shadowless() -> Iterator[None]:
    """Let no shape block a light.

    Analytic's shadow rays meet nothing.
    """

    def wrong(self: Analytic, scene: Any, index: int, light: Any, objects: Any, *rest: Any) -> Any:
        return np.zeros(len(objects), dtype=bool)

    with altered(Analytic, "blocked", wrong):
        yield


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
    """Clip by spheres around the eye.

    Analytic clips by distance where the scene says depth.
    """
    right = Analytic.clip_interval

    def wrong(self: Analytic, scene: Scene, directions: Any) -> Any:
        return right(self, replace(scene, clip="shell" if scene.clip == "depth" else scene.clip), directions)

    with altered(Analytic, "clip_interval", wrong):
        yield


@FAULTS.register(
    "reference/mitsuba_flux_factor",
    where="reference",
    stage=Stage.IRRADIANCE,
    who=("mitsuba_llvm", "mitsuba_scalar"),
    cases=("primitives/*", "several_lights/*", "shadows/*"),
)
@contextmanager
def mitsuba_flux_factor() -> Iterator[None]:
    """Double Mitsuba's intensity.

    Mitsuba is handed the flux over 2 pi as intensity.
    """
    right = mitsuba_scene.intensity

    def wrong(light: Any) -> list[float]:
        return [2 * channel for channel in right(light)]

    with replaced(right, wrong):
        yield


@contextmanager
def _sensor_with(change: Callable[[dict[str, Any]], dict[str, Any]]) -> Iterator[None]:
    """Change some entries of the dictionary that describes Mitsuba's camera to Mitsuba."""
    right = mitsuba_scene.sensor

    def wrong(*arguments: Any, **options: Any) -> Any:
        sensor = right(*arguments, **options)
        return sensor | change(sensor)

    with replaced(right, wrong):
        yield


@FAULTS.register(
    "reference/mitsuba_fovy",
    where="reference",
    stage=Stage.CAMERA,
    who=("mitsuba_llvm", "mitsuba_scalar"),
    also=(Stage.RAY,),
    cases=("cameras/*", "primitives/*"),
)
def mitsuba_fovy() -> AbstractContextManager[None]:
    """Widen Mitsuba's camera.

    Mitsuba's vertical angle is a thousandth too large.
    """
    return _sensor_with(lambda sensor: {"fov": sensor["fov"] * 1.001})


@FAULTS.register(
    "reference/mitsuba_horizontal_fovy",
    where="reference",
    stage=Stage.CAMERA,
    who=("mitsuba_llvm", "mitsuba_scalar"),
    also=(Stage.RAY,),
    cases=("cameras/*", "primitives/*"),
)
def mitsuba_horizontal_fovy() -> AbstractContextManager[None]:
    """Measure Mitsuba's angle along x.

    Mitsuba's angle is taken along the image's width.
    """
    return _sensor_with(lambda sensor: {"fov_axis": "x"})


@FAULTS.register(
    "reference/mitsuba_jittered",
    where="reference",
    stage=Stage.RADIANCE,
    who=("mitsuba_llvm", "mitsuba_scalar"),
    cases=("primitives/*", "several_lights/*", "shadows/*"),
)
def mitsuba_jittered() -> AbstractContextManager[None]:
    """Jitter the samples of Mitsuba's images.

    Mitsuba's samples are scattered over the pixel.
    """
    return _sensor_with(lambda sensor: {"sampler": sensor["sampler"] | {"jitter": True}})


@FAULTS.register(
    "reference/mitsuba_light_not_moved",
    where="reference",
    stage=Stage.IRRADIANCE,
    who=("mitsuba_llvm", "mitsuba_scalar"),
    also=(Stage.VISIBILITY,),
    cases=("several_lights/i*", "random_scenes/*", "invariance/*"),
)
@contextmanager
def mitsuba_light_not_moved() -> Iterator[None]:
    """Keep Mitsuba's first light for all.

    Mitsuba's one light is never put in the next one's place.
    """

    def wrong(world: Any, light: Any) -> None:
        return None

    with altered(mitsuba_scene.MitsubaScene, "place", wrong):
        yield


@FAULTS.register(
    "reference/mitsuba_near_plane",
    where="reference",
    stage=Stage.DISTANCE,
    who=("mitsuba_llvm", "mitsuba_scalar"),
    cases=("primitives/*", "clipping/*"),
)
@contextmanager
def mitsuba_near_plane() -> Iterator[None]:
    """Take the near plane's depth off Mitsuba's distances.

    Mitsuba's distances are measured from the near plane.
    """
    right = program.stage_answers

    def wrong(scene: Any, *rest: Any) -> Any:
        found = right(scene, *rest)
        if Stage.DISTANCE in found:
            found[Stage.DISTANCE] = found[Stage.DISTANCE] - scene.camera.near
        return found

    with replaced(right, wrong):
        yield


@FAULTS.register(
    "reference/mitsuba_no_instances",
    where="reference",
    stage=Stage.NORMAL,
    who=("mitsuba_llvm", "mitsuba_scalar"),
    also=(Stage.OBJECT, Stage.DISTANCE, Stage.POSITION),
    cases=("transforms/*_mirrored", "transforms/sphere_*", "normals/*"),
)
@contextmanager
def mitsuba_no_instances() -> Iterator[None]:
    """Never wrap a shape in an instance.

    Mitsuba is handed mirrored and stretched shapes as they are, which it draws wrong.
    """
    right = mitsuba_scene.needs_instance

    def wrong(shape: Any) -> bool:
        return False

    with replaced(right, wrong):
        yield


@FAULTS.register(
    "reference/mitsuba_normal_mirrored",
    where="reference",
    stage=Stage.NORMAL,
    who=("mitsuba_llvm", "mitsuba_scalar"),
    cases=("primitives/*", "transforms/*"),
)
@contextmanager
def mitsuba_normal_mirrored() -> Iterator[None]:
    """Turn Mitsuba's normals round.

    Mitsuba's normals are read inwards.
    """
    right = program._shading_normals

    def wrong(scene: Any, hits: Any) -> Any:
        return -right(scene, hits)

    with replaced(right, wrong):
        yield


@FAULTS.register(
    "reference/radiance_both_sides",
    where="reference",
    stage=Stage.RADIANCE,
    who=("radiance",),
    cases=("sidedness/*_from_the_viewer", "inside/one_sided_sphere"),
)
@contextmanager
def radiance_both_sides() -> Iterator[None]:
    """Leave out the pattern that blackens one-sided surfaces from behind.

    Radiance's surfaces are all two-sided.
    """
    right = radiance_scene.painted

    def wrong(scene: Scene) -> list[str]:
        return right(replace(scene, shapes=tuple(replace(shape, two_sided=True) for shape in scene.shapes)))

    with altered(radiance_scene, "painted", wrong):
        yield


@FAULTS.register(
    "reference/radiance_flux_factor",
    where="reference",
    stage=Stage.IRRADIANCE,
    who=("radiance",),
    cases=("primitives/*", "several_lights/*"),
)
@contextmanager
def radiance_flux_factor() -> Iterator[None]:
    """Double what rtrace answers.

    Radiance's light is read as that of half a watt.
    """
    right = RadianceWorld.per_watt

    with altered(RadianceWorld, "per_watt", property(lambda world: 2 * right.__get__(world))):
        yield


@FAULTS.register(
    "reference/radiance_fovy",
    where="reference",
    stage=Stage.RAY,
    who=("radiance",),
    cases=("cameras/*", "primitives/*"),
)
@contextmanager
def radiance_fovy() -> Iterator[None]:
    """Widen the view that rtrace is handed.

    Radiance's vertical angle is a thousandth too large.
    """
    right = radiance_scene.view

    def wrong(camera: Camera) -> Any:
        return right(replace(camera, fovy=camera.fovy * 1.001))

    with replaced(right, wrong):
        yield
