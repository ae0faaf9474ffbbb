"""Starting Tachyon, one picture a call; exposures climb until radiance has enough steps; face numbers as colours."""

import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from rayproof.cases.scene import PointLight, Scene, Shape
from rayproof.reference.tachyon.scene import Facets, Look, Paint, Surface, from_behind, model, numbers

INSTALL = "Tachyon is not installed; pip install --no-deps passagemath-tachyon, or apt-get install tachyon-bin-nox."
WHITE = 65535
# Full shading with shadows, no highlights. One thread: several renders run at once.
# Tachyon ignores hits nearer than this, and triangles whose determinant with the ray is below it. Tachyon's units are
# metres: larger ones would miss triangles, smaller ones take rounding for blockers.
EPSILON = 1e-9  # m and m^2; tachyon.h
OPTIONS = ("-fullshade", "-shade_nullphong", "-numthreads", "1", "-format", "PPM48")


def executable() -> str | None:
    """Return the program's path, or None; the wheel's comes first, whose version pip knows."""
    wheels = find_spec("sage_wheels")
    for folder in wheels.submodule_search_locations or () if wheels is not None else ():
        if (path := Path(folder) / "bin" / "tachyon").is_file():
            return str(path)
    return shutil.which("tachyon")


def missing() -> str | None:
    """Return how to install the program, or None if it is there."""
    return INSTALL if executable() is None else None


def command() -> str:
    """Return the program's path.

    Raises:
        RuntimeError: it is not installed.

    """
    path = executable()
    if path is None:
        raise RuntimeError(INSTALL)
    return path


@cache
def version() -> str:
    """Return program and version."""
    ended = subprocess.run([command()], capture_output=True, text=True, check=False, timeout=60)
    found = re.search(r"Version (\S+)", ended.stdout)
    if found is None:
        raise RuntimeError(f"tachyon names no version: {(ended.stdout + ended.stderr).strip()[:200]!r}")
    return f"Tachyon {found[1]}"


def picture(scene: str, width: int, height: int) -> np.ndarray:
    """Return the codes at the centres of width x height pixels, (height, width, 3), 0 to 65535.

    Tachyon's coordinates are left-handed, so its pictures are mirrored; and it samples the corners of pixels, so of
    twice as many in each direction every second is a centre.

    Raises:
        RuntimeError: it failed; the message ends with what it said.

    """
    with tempfile.TemporaryDirectory(prefix="rayproof-tachyon-") as name:
        folder = Path(name)
        (folder / "scene.dat").write_text(scene, encoding="ascii")
        size = ("-res", str(2 * width), str(2 * height))
        ended = subprocess.run(
            [command(), "scene.dat", *OPTIONS, *size, "-o", "picture.ppm"],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
        path = folder / "picture.ppm"
        if ended.returncode != 0 or not path.is_file():
            raise RuntimeError(f"Tachyon ended with {ended.returncode}: {(ended.stdout + ended.stderr).strip()[-500:]}")
        content = path.read_bytes()
    header = f"P6\n{2 * width} {2 * height}\n{WHITE}\n".encode()
    if not content.startswith(header):
        raise RuntimeError(f"Tachyon wrote a picture that begins with {content[:40]!r}")
    codes = np.frombuffer(content, ">u2", offset=len(header)).reshape(2 * height, 2 * width, 3)
    return codes[1::2, ::-1][:, 1::2].astype(np.float64)


# Lights in Tachyon's units, and its pictures of them at several exposures.
#
# Each value is taken from the longest exposure that does not saturate it, so that it has at least 16383 steps. Tachyon
# cuts off instead of rounding, so half a step is added.


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


# What colours the surfaces get: their numbers, white, or what they are.


def numbered(shape: Shape, surface: Surface, index: int) -> list[Look]:
    """Shine with the shape's and the face's number, half a step above, for Tachyon cuts off."""
    faces = surface.numbers.tolist() if isinstance(surface, Facets) else [0]
    steps = [(index + 1, face % (WHITE + 1), face // (WHITE + 1)) for face in faces]
    return [Look(color=tuple((step + 0.5) / WHITE for step in triple), shines=True) for triple in steps]


def faces(codes: np.ndarray) -> np.ndarray:
    """Return (shape index, face index), -1 on a miss, from a picture (height, width, 3) of such colours."""
    shape = codes[..., 0] - 1
    face = np.where(shape >= 0, codes[..., 1] + codes[..., 2] * (WHITE + 1), -1)
    return np.stack([shape, face], axis=-1)


def white(shape: Shape, surface: Surface, index: int) -> list[Look]:
    """Reflect everything."""
    return [Look(color=(1.0, 1.0, 1.0), shines=False)] * _count(surface)


def diffuse(scene: Scene) -> Callable[[Shape, Surface, int], list[Look]]:
    """Return a paint of albedos in which one-sided surfaces that the eye is behind are black."""
    eye = np.asarray(scene.camera.eye, dtype=np.float64)

    def paint(shape: Shape, surface: Surface, index: int) -> list[Look]:
        black = (0.0, 0.0, 0.0)
        dark = from_behind(surface, eye) & (not shape.two_sided)
        return [Look(color=black if each else shape.albedo, shines=False) for each in dark.tolist()]

    return paint


def _count(surface: Surface) -> int:
    return len(surface.numbers) if isinstance(surface, Facets) else 1
