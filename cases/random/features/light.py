"""Features of lights: how many, how bright, and where no renderer likes them."""

from dataclasses import replace
from typing import cast

import numpy as np

from rayproof.cases.placement import mapped
from rayproof.cases.random.draft import FLUX, Draft, rgb
from rayproof.cases.random.features import FEATURES, Step
from rayproof.cases.scene import Cube, PointLight, Rgb, Sphere, Square, Triangle, Vector


def _move(draft: Draft, position: Vector) -> None:
    """Move one of the lights."""
    index = draft.draws.whole(0, len(draft.lights) - 1)
    draft.lights[index] = replace(draft.lights[index], position=position)


@FEATURES.register("no_light", step=Step.LIGHTS, group="lights", bare=True, what="There is no light.")
def no_light(draft: Draft) -> None:
    """Remove every light."""
    draft.lights.clear()


@FEATURES.register("many_lights", step=Step.LIGHTS, group="lights", bare=True, what="There are ten to twenty lights.")
def many_lights(draft: Draft) -> None:
    """Add lights all around."""
    while len(draft.lights) < draft.draws.choice((10, 14, 20)):
        x, y, z = np.asarray(draft.draws.direction()) * draft.draws.uniform(2, 6)
        draft.lights.append(PointLight(position=(float(x), float(y), float(z)), flux=rgb(draft.draws, 0, FLUX)))


@FEATURES.register("light_inside", step=Step.LIGHTS, group="light place", what="A light is inside a shape.")
def light_inside(draft: Draft) -> None:
    """Put a light into a sphere or a cube."""
    _move(draft, draft.inner_point(draft.any_of(Sphere, Cube)))


@FEATURES.register("light_on_surface", step=Step.LIGHTS, group="light place", what="A light lies on a surface.")
def light_on_surface(draft: Draft) -> None:
    """Put a light onto a shape's surface."""
    _move(draft, draft.surface_point(draft.draws.whole(0, len(draft.shapes) - 1)))


@FEATURES.register("light_at_eye", step=Step.LIGHTS, group="light place", bare=True, what="A light is at the eye.")
def light_at_eye(draft: Draft) -> None:
    """Put a light where the eye is."""
    _move(draft, draft.eye)


@FEATURES.register("grazing_light", step=Step.LIGHTS, group="light place", what="A light all but grazes a surface.")
def grazing_light(draft: Draft) -> None:
    """Put a light 1e-6 to 1e-2 above the plane of a square or a cube's face."""
    index = draft.any_of(Square, Cube)
    height = 0.0 if isinstance(draft.shapes[index], Square) else 0.5
    above = height + draft.draws.logarithmic(1e-6, 1e-2)
    _move(draft, mapped(draft.shapes[index].to_world, (draft.draws.uniform(0.2, 3), draft.draws.uniform(-1, 1), above)))


@FEATURES.register("flux_extremes", step=Step.LIGHTS, bare=True, what="Fluxes are 0, or 1e12 apart between channels.")
def flux_extremes(draft: Draft) -> None:
    """Give lights channels that are 0 or 1e12 apart."""
    options: tuple[Rgb, ...] = ((0.0, 0.0, 0.0), (0.0, FLUX, 1e-9 * FLUX), (1e-6, 1.0, 1e6), (1e12, 1.0, 0.0))
    draft.lights[:] = [replace(light, flux=draft.draws.choice(options)) for light in draft.lights]


@FEATURES.register("simplified", step=Step.LIGHTS, group="shading", bare=True, what="Shading is simplified.")
def simplified(draft: Draft) -> None:
    """Take the lights' colours as they are."""
    draft.shading = "simplified"
    scale = 1 / FLUX
    draft.lights[:] = [
        replace(light, flux=cast(Rgb, tuple(value * scale for value in light.flux))) for light in draft.lights
    ]


@FEATURES.register("light_in_plane", step=Step.LIGHTS, group="light place", what="A light lies in a surface's plane.")
def light_in_plane(draft: Draft) -> None:
    """Put a light into the plane of a square or a triangle, beside it."""
    index = draft.any_of(Square, Triangle)
    shape = draft.shapes[index]
    if isinstance(shape, Triangle):
        first, second, third = map(np.asarray, shape.vertices)
        x, y, z = first + 1.7 * (second - first) + 0.4 * (third - first)
        _move(draft, mapped(shape.to_world, (float(x), float(y), float(z))))
    else:
        _move(draft, mapped(shape.to_world, (draft.draws.uniform(0.6, 2), draft.draws.uniform(-1, 1), 0.0)))
