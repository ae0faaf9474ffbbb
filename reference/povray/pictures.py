"""POV-Ray's pictures: which face a pixel sees, written in colours, and radiance at several exposures.

A portable pixmap of 16 bits a channel holds 65535 steps. Colours that shine by themselves carry integers exactly. Light
is rendered at exposures that grow fourfold, and each value is taken from the longest one that it does not saturate, so
that it has at least 16383 steps. Each channel has exposures of its own: they may be a million million apart.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.reference.povray.program import trace, workshop
from rayproof.reference.povray.shapes import vector
from rayproof.reference.povray.worlds import Look, scale_of, world

WHITE = 65535
LADDER = 4.0
# Beyond this many exposures a value is 2^-40 of the brightest.
MOST_EXPOSURES = 20
# What the first, shortest exposure leaves above the brightest pixel centre that is expected.
HEADROOM = 1.1
# 2 / (1 + (d / fade)^2) is 2 fade^2 / d^2 to (fade / d)^2: 1e-12 at a metre from the light, at 1024 units a metre.
FADE = 2.0**-10  # units


def faces_look(index: int, face: int) -> str:
    """Return a texture that shines with the shape's and the face's index; black is for misses."""
    color = f"<{index + 1},{face % (WHITE + 1)},{face // (WHITE + 1)}>/{WHITE}"
    return f"pigment {{ rgb {color} }} finish {{ ambient 0 diffuse 0 emission 1 }}"


def faces(picture: np.ndarray) -> np.ndarray:
    """Return (shape index, face index), -1 on a miss, from a picture (height, width, 3) of such textures."""
    shape = picture[..., 0] - 1
    face = np.where(shape >= 0, picture[..., 1] + picture[..., 2] * (WHITE + 1), -1)
    return np.stack([shape, face], axis=-1).astype(np.float64)


def radiance(scene: Scene, samples: int, brightest: np.ndarray, darkest: np.ndarray) -> np.ndarray:
    """Return the mean radiance [W/(m^2 sr)] over samples x samples points per pixel, (height, width, 3).

    `brightest` and `darkest` (3,) [W/(m^2 sr)] are each channel's extreme values above 0 that are expected, for the
    exposures; of a channel that is black any two alike.
    """
    camera = scene.camera
    width, height = camera.width * samples, camera.height * samples
    widest = float(np.max(brightest / darkest))
    count = min(MOST_EXPOSURES, 1 + max(0, math.ceil(math.log(widest, LADDER))))
    # A number declared on the command line keeps six digits, hence a whole one.
    renders = {f"{step}.ppm": [f"Declare=Step={step}"] for step in range(count)}
    while True:
        exposure = 1 / (HEADROOM * brightest)
        lights = f"#declare Exposure = {vector(exposure)} * pow({LADDER}, Step);\n{_lights(scene)}"
        with workshop(world(scene, _lit_look(scene)) + lights) as folder:
            trace(folder, width=width, height=height, renders=renders)
            pictures = [read(folder / name) for name in renders]
        saturated = pictures[0].max(axis=(0, 1)) >= WHITE
        if not saturated.any():
            break
        brightest = np.where(saturated, brightest * LADDER, brightest)  # between the pixel centres it may be brighter
    merged = merge(pictures, [exposure * LADDER**step for step in range(count)])
    return merged.reshape(camera.height, samples, camera.width, samples, 3).mean(axis=(1, 3))


def merge(pictures: Sequence[np.ndarray], exposures: Sequence[float | np.ndarray]) -> np.ndarray:
    """Return values from pictures at growing exposures, of each channel or all: the longest that does not saturate."""
    value = pictures[0] / WHITE / exposures[0]
    for picture, exposure in zip(pictures[1:], exposures[1:], strict=True):
        value = np.where(picture < WHITE, picture / WHITE / exposure, value)
    return value


def read(path: Path) -> np.ndarray:
    """Return the codes of a 16-bit portable pixmap, (height, width, 3).

    Raises:
        RuntimeError: the file is no such pixmap.

    """
    content = path.read_bytes()
    words: list[bytes] = []
    start = 0
    while len(words) < 4:
        end = content.index(b"\n", start)
        words += content[start:end].partition(b"#")[0].split()
        start = end + 1
    kind, width, height, white = words
    if kind != b"P6" or int(white) != WHITE:
        raise RuntimeError(f"POV-Ray wrote a picture of kind {kind!r} with {white!r} steps")
    return np.frombuffer(content, ">u2", offset=start).reshape(int(height), int(width), 3).astype(np.float64)


def _lit_look(scene: Scene) -> Look:
    """Return diffuse textures; a one-sided surface is black from behind."""
    looks = []
    for shape in scene.shapes:
        front = f"texture {{ pigment {{ rgb {vector(shape.albedo)} }} finish {{ ambient 0 diffuse 1 }} }}"
        back = "interior_texture { pigment { rgb 0 } finish { ambient 0 diffuse 0 } }"
        looks.append(front if shape.two_sided else f"{front} {back}")
    return lambda index, face: looks[index]


def _lights(scene: Scene) -> str:
    """Return the lights, with POV-Ray's Lambert's law in mind, which has no 1 / pi."""
    scale = scale_of(scene)
    texts = []
    for light in scene.lights:
        place, color = vector(np.multiply(light.position, scale)), np.asarray(light.flux)
        fade = ""
        if scene.shading == "inverse_square":
            color = color / (4 * np.pi**2) * scale**2 / (2 * FADE**2)
            fade = f"fade_distance {FADE:.17g} fade_power 2"
        texts.append(f"light_source {{ {place} color rgb Exposure * {vector(color)} {fade} }}")
    return "\n".join(texts) + "\n"
