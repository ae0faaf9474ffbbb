"""Renderers made of the oracle, each with a limit of its own: `--subject python:tests/cases/limited_renderers.py:NAME`.

Each answers a scene within its limit exactly as the oracle does. `LIMITED` has the cases that are beyond it.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import lru_cache

import numpy as np

import rayproof
from rayproof.cases.scene import Cube, Plane, PointLight, Scene, Shape, Sphere

Images = dict[str, np.ndarray]
Stages = Iterable[str]
Renderer = Callable[[Scene, Stages], Images]

STAGES = ("ray", "object", "distance", "position", "normal", "visibility", "irradiance", "exitance", "radiance")
LIGHT_STAGES = ("irradiance", "exitance", "radiance")
OF_A_MISS = {"object": -1.0, "distance": np.inf}
LIMITED: dict[str, tuple[Renderer, str, tuple[str, ...]]] = {}  # name -> function, case, stages that are wrong


def limited(case: str, *wrong: str) -> Callable[[Renderer], Renderer]:
    """Register a renderer, the case in which its limit shows and stages in which it does."""

    def register(renderer: Renderer) -> Renderer:
        LIMITED[renderer.__name__] = (renderer, case, wrong)
        return renderer

    return register


@lru_cache(maxsize=8)
def _all_stages(scene: Scene) -> Images:
    return rayproof.oracle(scene, STAGES)


def right(scene: Scene, stages: Stages) -> Images:
    """Render a scene as the oracle does."""
    images = _all_stages(scene)
    return {str(stage): images[str(stage)] for stage in stages}


def _few_lights(scene: Scene, stages: Stages, most: int) -> Images:
    images = right(replace(scene, lights=scene.lights[:most]), stages)
    missing = len(scene.lights) - most
    if missing > 0 and "visibility" in images:
        images["visibility"] = np.pad(images["visibility"], ((0, 0), (0, 0), (0, missing)))
    return images


@limited("extremes/many_lights", "radiance", "visibility")
def sixteen_lights(scene: Scene, stages: Stages) -> Images:
    """Count the first 16 lights."""
    return _few_lights(scene, stages, 16)


def _another_up(scene: Scene, stages: Stages, *, upward: bool) -> Images:
    camera = scene.camera
    forward, up = np.subtract(camera.target, camera.eye), np.asarray(camera.up, float)
    cosine = forward @ up / np.linalg.norm(forward) / np.linalg.norm(up)
    if (cosine if upward else -cosine) <= np.cos(np.radians(8)):
        return right(scene, stages)
    return right(replace(scene, camera=replace(camera, up=(0.0, 1.0, 0.0))), stages)


@limited("extremes/many_shapes", "radiance", "ray")
def another_up_in_views_upward(scene: Scene, stages: Stages) -> Images:
    """Take y for the up vector within 8 degrees of it."""
    return _another_up(scene, stages, upward=True)


def _wrapped(scene: Scene, stages: Stages, channel: int, count: int) -> Images:
    images = right(scene, stages)
    if "object" in images:
        ids = images["object"].copy()
        ids[..., channel] = np.where(ids[..., channel] < 0, ids[..., channel], ids[..., channel] % count)
        images["object"] = ids
    return images


@limited("extremes/many_shapes", "object")
def object_ids_of_one_byte(scene: Scene, stages: Stages) -> Images:
    """Write ids of shapes modulo 256."""
    return _wrapped(scene, stages, 0, 256)


@limited("extremes/many_shapes", "radiance", "object")
def shapes_256(scene: Scene, stages: Stages) -> Images:
    """Render the first 256 shapes."""
    return right(replace(scene, shapes=scene.shapes[:256]), stages)


@limited("extremes/eye_in_a_plane", "radiance", "irradiance")
def hit_of_0_over_0(scene: Scene, stages: Stages) -> Images:
    """Take 0 / 0 for a hit where eye and ray lie in an infinite plane: its distance, and all that follows, is NaN."""
    images = {name: image.copy() for name, image in right(scene, STAGES).items()}
    for index, shape in enumerate(scene.shapes):
        inverse = np.linalg.inv(np.asarray(shape.to_world))
        if isinstance(shape, Plane) and (inverse @ (*scene.camera.eye, 1.0))[2] == 0:
            parallel = images["ray"] @ inverse[2, :3] == 0
            images["object"][parallel] = (index, 0)
            images["normal"][parallel] = inverse[2, :3] / np.linalg.norm(inverse[2, :3])
            for name in ("distance", "position", "irradiance", "exitance", "radiance"):
                images[name][parallel] = np.nan
    return {str(stage): images[str(stage)] for stage in stages}


def _leaking(scene: Scene, stages: Stages, kind: type[Shape]) -> Images:
    """Render with shapes of a kind that let the light of a light inside them out."""
    images = dict(right(scene, STAGES))
    lights = [(light, _around(light, scene.shapes, kind)) for light in scene.lights]
    if any(around for _, around in lights):
        light_images = {name: np.zeros_like(images[name]) for name in LIGHT_STAGES}
        visibility = []
        for light, around in lights:
            closed = replace(scene, lights=(light,))
            lit = right(closed, STAGES)
            if around:
                unblocked = replace(closed, shapes=tuple(s for i, s in enumerate(scene.shapes) if i not in around))
                outside = ~np.isin(images["object"][..., :1], [*around, -1])
                lit = {name: np.where(outside, image, lit[name]) for name, image in right(unblocked, STAGES).items()}
            light_images = {name: image + lit[name] for name, image in light_images.items()}
            visibility.append(lit["visibility"])
        images |= light_images | {"visibility": np.concatenate(visibility, -1)}
    return {str(stage): images[str(stage)] for stage in stages}


def _around(light: PointLight, shapes: Iterable[Shape], kind: type[Shape]) -> list[int]:
    """Return the indices of the shapes of a kind that have a light inside."""
    around = []
    for index, shape in enumerate(shapes):
        place = (np.linalg.inv(np.asarray(shape.to_world)) @ (*light.position, 1.0))[:3]
        if isinstance(shape, kind) and (
            (isinstance(shape, Sphere) and np.linalg.norm(place - shape.center) < shape.radius)
            or (isinstance(shape, Cube) and np.abs(place).max() < 0.5)
        ):
            around.append(index)
    return around


@limited("extremes/lights_in_solids", "radiance", "visibility")
def spheres_that_leak(scene: Scene, stages: Stages) -> Images:
    """Let light out of a closed sphere."""
    return _leaking(scene, stages, Sphere)


@limited("extremes/lights_in_solids", "radiance", "visibility")
def cubes_that_leak(scene: Scene, stages: Stages) -> Images:
    """Let light out of a closed cube."""
    return _leaking(scene, stages, Cube)


def _albedo(scene: Scene, stages: Stages, value: float, instead: float) -> Images:
    if not any(value in shape.albedo for shape in scene.shapes):
        return right(scene, stages)
    shapes = []
    for shape in scene.shapes:
        red, green, blue = (instead if channel == value else channel for channel in shape.albedo)
        shapes.append(replace(shape, albedo=(red, green, blue)))
    return right(replace(scene, shapes=tuple(shapes)), stages)


@limited("extremes/lights_in_solids", "radiance", "exitance")
def albedo_0_is_the_default(scene: Scene, stages: Stages) -> Images:
    """Take an albedo of 0 for one that is left out."""
    return _albedo(scene, stages, 0.0, 0.5)


@limited("extremes/lights_in_solids", "radiance", "exitance")
def albedo_1_is_a_byte(scene: Scene, stages: Stages) -> Images:
    """Take an albedo of 1 for a byte, of at most 255."""
    return _albedo(scene, stages, 1.0, 1 / 255)


def _columns(scene: Scene, stages: Stages, most: int) -> Images:
    """Repeat the first columns after the column `most`."""
    place = np.arange(scene.camera.width) % most
    return {name: image[:, place] for name, image in right(scene, stages).items()}


@limited("extremes/wide_and_bright", "radiance", "ray", "object")
def columns_of_one_byte(scene: Scene, stages: Stages) -> Images:
    """Count columns modulo 256."""
    return _columns(scene, stages, 256)


@limited("extremes/very_wide_and_dim", "radiance", "ray", "object")
def columns_1024(scene: Scene, stages: Stages) -> Images:
    """Count columns modulo 1024."""
    return _columns(scene, stages, 1024)


@limited("extremes/wide_and_bright", "radiance")
def half_floats_at_most(scene: Scene, stages: Stages) -> Images:
    """Write no radiance above 65 504."""
    images = right(scene, stages)
    return {name: np.minimum(image, 65_504) if name == "radiance" else image for name, image in images.items()}


@limited("extremes/very_wide_and_dim", "radiance", "irradiance")
def dim_is_black(scene: Scene, stages: Stages) -> Images:
    """Set all light to 0 in an image whose irradiance is nowhere above 1e-9."""
    dark = right(scene, ["irradiance"])["irradiance"].max() < 1e-9
    images = right(scene, stages)
    return {name: np.zeros_like(image) if dark and name in LIGHT_STAGES else image for name, image in images.items()}


def _whole_tiles(scene: Scene, stages: Stages, side: int) -> Images:
    """Render images of more than 7680 pixels in whole tiles; what is left over is empty."""
    images = right(scene, stages)
    height, width = scene.camera.height, scene.camera.width
    if width * height <= 7680:
        return images
    tiled = {}
    for name, image in images.items():
        tiled[name] = np.full_like(image, OF_A_MISS.get(name, 0.0))
        rows, columns = height // side * side, width // side * side
        tiled[name][:rows, :columns] = image[:rows, :columns]
    return tiled


@limited("extremes/wide_and_bright", "radiance", "object")
def whole_tiles_32(scene: Scene, stages: Stages) -> Images:
    """Leave out what remains beside tiles of 32 x 32 pixels."""
    return _whole_tiles(scene, stages, 32)
