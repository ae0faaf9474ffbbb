"""Lights in Tachyon's units, and its pictures of them at several exposures.

Each value is taken from the longest exposure that does not saturate it, so that it has at least 16383 steps. Tachyon
cuts off instead of rounding, so half a step is added.
"""

import numpy as np

from rayproof.cases.scene import PointLight, Scene
from rayproof.reference.tachyon.models import Paint, model, numbers
from rayproof.reference.tachyon.program import WHITE, picture

LADDER = 4.0
# From a picture in which a value has no step, this many rungs up it still does not saturate: 4^6 < 65535.
LEAP = 6
# Nothing that is fainter than the brightest by 4^20, 10^12, counts as light.
RUNGS = 20
# Radiance in units of the lights' flux per square metre: 1e-11 is a light 10^5 m away, 10^9 one within a hundredth of a
# millimetre.
DARKEST, BRIGHTEST = 1e-11, 1e9
# Tachyon skips light whose intensity, before its colour, is below 1/512 of the whole. So all that distance and angle
# may take away is given to the intensity, and taken from the colour, which it does not look at.
INTENSE = 2.0**60
EVEN = f"CONSTANT {1 / INTENSE:.17g} LINEAR 0 QUADRATIC 0"
FALLING = f"CONSTANT 0 LINEAR 0 QUADRATIC {1 / INTENSE:.17g}"


def visible(scene: Scene, paint: Paint, light: PointLight) -> np.ndarray:
    """Return where the light arrives at all, (height, width) bool, whatever its flux and distance."""
    seen = np.zeros((scene.camera.height, scene.camera.width), dtype=bool)
    # Cosines, at three exposures: beyond 2^31 steps Tachyon's conversion to a whole number makes white black.
    for rung in (0, LEAP, 2 * LEAP):
        lamp = _lamp(light, np.full(3, LADDER**rung), EVEN)
        seen |= picture(model(scene, paint, lamp), scene.camera.width, scene.camera.height)[..., 0] > 0
    return seen


def radiance(scene: Scene, paint: Paint, samples: int) -> np.ndarray:
    """Return the mean radiance [W/(m^2 sr)] over samples x samples points per pixel, (height, width, 3)."""
    camera = scene.camera
    size = (camera.width * samples, camera.height * samples)
    value = np.zeros((size[1], size[0], 3))
    flux = sum(max(light.flux) for light in scene.lights)
    if flux > 0:
        _climb(scene, paint, value, flux)
    return value.reshape(camera.height, samples, camera.width, samples, 3).mean(axis=(1, 3))


def _climb(scene: Scene, paint: Paint, value: np.ndarray, flux: float) -> None:
    """Fill in `value` (height, width, 3) from pictures at growing exposures, until all that is lit has enough steps."""
    # What the next exposure will not saturate, and so is to be taken from it. Only that: see `visible`.
    fresh = np.ones(value.shape, dtype=bool)
    exposure, last = 1 / (flux * BRIGHTEST), 1 / (flux * DARKEST)
    while fresh.any() and exposure <= last:
        codes = picture(model(scene, paint, _lamps(scene, exposure)), value.shape[1], value.shape[0])
        if not fresh.all() or codes.any():
            last = min(last, exposure * LADDER**RUNGS) if fresh.all() else last
        value[fresh] = _value(codes[fresh], exposure)
        fresh &= codes < (WHITE - 1) / LADDER
        exposure *= LADDER if codes[fresh].any() else LADDER**LEAP


def _value(codes: np.ndarray, exposure: float) -> np.ndarray:
    return np.where(codes > 0, (codes + 0.5) / WHITE, 0.0) / exposure


def _lamps(scene: Scene, exposure: float) -> str:
    """Return the scene's lights, for radiance times `exposure`; Tachyon's Lambert's law lacks 1 / pi."""
    if scene.shading == "simplified":
        return "\n".join(_lamp(light, np.multiply(light.flux, exposure), EVEN) for light in scene.lights)
    scale = exposure / (4 * np.pi**2)
    return "\n".join(_lamp(light, np.multiply(light.flux, scale), FALLING) for light in scene.lights)


def _lamp(light: PointLight, color: np.ndarray, fading: str) -> str:
    return f"LIGHT CENTER {numbers(light.position)} RAD 0 ATTENUATION {fading} COLOR {numbers(color / INTENSE)}"
