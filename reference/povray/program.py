"""Starting POV-Ray; SDL for camera, lights and probing loops; exposures and probed numbers read back as stages."""

import math
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.povray.scene import solid, vector

INSTALL = "POV-Ray is not installed; apt-get install --no-install-recommends povray (or your system's package of it)."
# No antialiasing: one sample at the pixel's centre. 16 bits without gamma, and no dithering, which is random. Bounds
# that we give stay: POV-Ray would take those of unions for needless. One thread: several renders run at once.
# POV-Ray ignores what blocks a feeler within 1e-3 of its units from either end: a millionth of a metre at this scale.
# Unlit scenes keep to metres, because nothing farther than 1e7 units is hit.
LIT_SCALE = 1024.0
SHADOW_TOLERANCE = 1e-3  # units; POV-Ray 3.7, render/trace.cpp
DEPTH_TOLERANCE = 1e-6  # units; shape/*.cpp
OPTIONS = {
    "Output_File_Type": "P",
    "Bits_Per_Color": "16",
    "File_Gamma": "1.0",
    "Dither": "off",
    "Antialias": "off",
    "Display": "off",
    "Remove_Bounds": "off",
    "Split_Unions": "off",
    "Work_Threads": "1",
}


def missing() -> str | None:
    """Return how to install the program, or None if it is there."""
    return INSTALL if shutil.which("povray") is None else None


@cache
def version() -> str:
    """Return program and version."""
    # It starts nothing and writes this to standard error.
    ended = subprocess.run(["povray", "--version"], capture_output=True, text=True, check=False, timeout=60)
    found = re.search(r"POV-Ray (\d\S*)", ended.stderr + ended.stdout)
    if found is None:
        raise RuntimeError(f"povray --version names no version: {(ended.stderr + ended.stdout).strip()[:200]!r}")
    return f"POV-Ray {found[1]}"


@contextmanager
def workshop(scene: str) -> Iterator[Path]:
    """Yield a folder that holds `scene` as scene.pov, and remove it with all that was written there.

    Debian's configuration lets POV-Ray write only into the working folder and /tmp.
    """
    with tempfile.TemporaryDirectory(prefix="rayproof-povray-") as name:
        folder = Path(name)
        (folder / "scene.pov").write_text(scene, encoding="ascii")
        yield folder


def trace(folder: Path, *, width: int, height: int, renders: Mapping[str, Sequence[str]]) -> None:
    """Render scene.pov into several images at once: file name -> further options.

    A render spends most of its time asleep (POV-Ray's front end polls), which is why they run at once.

    Raises:
        RuntimeError: a render failed; the message ends with what POV-Ray said.

    """
    # Home is the workshop too: no settings of the user's, and nothing left behind among them.
    environment = {**os.environ, "HOME": str(folder), "POVINC": str(folder)}
    size = [f"Width={width}", f"Height={height}", *(f"{name}={value}" for name, value in OPTIONS.items())]
    running = {
        image: subprocess.Popen(
            ["povray", "Input_File_Name=scene.pov", f"Output_File_Name={image}", *size, *options],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        )
        for image, options in renders.items()
    }
    try:
        said = {image: process.communicate()[1] for image, process in running.items()}
    finally:
        for process in running.values():
            process.kill()
            process.wait()
    for image, process in running.items():
        if process.returncode != 0 or not (folder / image).is_file():
            raise RuntimeError(f"POV-Ray ended with {process.returncode}: {said[image].strip()[-500:]}")


# A scene in SDL: the camera by explicit vectors, what it sees, and what blocks light.
#
# Clipping concerns camera rays only. So where a scene clips there are two worlds: `Seen`, clipped and without shadow,
# and `World`, whole and without image.


# (shape index, face index) -> SDL of what that face looks like
Look = Callable[[int, int], str]

FARTHEST = 1e7  # units; configbackend.h, MAX_DISTANCE

HEAD = """#version 3.7;
global_settings { assumed_gamma 1.0 adc_bailout 0 max_trace_level 1 ambient_light 0 }
"""


def scale_of(scene: Scene) -> float:
    """Return POV-Ray's units per metre."""
    return LIT_SCALE if scene.lights else 1.0


def world(scene: Scene, look: Look) -> str:
    """Return the scene in SDL, without lights: the camera and the objects, and what `probing` needs to know."""
    scale = scale_of(scene)
    solids = [
        text
        for index, shape in enumerate(scene.shapes)
        if (text := solid(shape, scale, lambda face, index=index: look(index, face))) is not None
    ]
    parts = [HEAD, _camera(scene, scale)]
    if solids:
        parts += [f"#declare Solid{number} = {text}" for number, text in enumerate(solids)]
        whole = " ".join(f"object {{ Solid{number} }}" for number in range(len(solids)))
        parts.append(f"#declare World = union {{ {whole} }}")
        clip = _clip(scene, scale)
        if clip:
            clipped = " ".join(f"object {{ Solid{number} {clip} }}" for number in range(len(solids)))
            parts.append(f"#declare Seen = union {{ {clipped} }}")
            parts.append("object { Seen no_shadow } object { World no_image }")
        else:
            parts.append("#declare Seen = World; object { World }")
    return "\n".join(parts) + "\n"


def _camera(scene: Scene, scale: float) -> str:
    camera = scene.camera
    return f"""#declare Eye = {vector(np.multiply(camera.eye, scale))};
#declare Forward = vnormalize({vector(np.multiply(camera.target, scale))} - Eye);
#declare Rightward = vnormalize(vcross(Forward, vnormalize({vector(camera.up)})));
#declare Upward = vcross(Rightward, Forward);
#declare Across = Rightward * (tan(radians({camera.fovy:.17g}) / 2) * {camera.width} / {camera.height});
#declare Along = Upward * tan(radians({camera.fovy:.17g}) / 2);
camera {{ perspective location Eye direction Forward right 2 * Across up 2 * Along }}"""


def _clip(scene: Scene, scale: float) -> str:
    near, far = (f"{depth * scale:.17g}" for depth in (scene.camera.near, scene.camera.far))
    if scene.clip == "none":
        return ""
    if scene.clip == "shell":
        return f"clipped_by {{ sphere {{ Eye, {near} inverse }} sphere {{ Eye, {far} }} }}"
    return (
        f"clipped_by {{ plane {{ -Forward, -vdot(Forward, Eye) - {near} }} "
        f"plane {{ Forward, vdot(Forward, Eye) + {far} }} }}"
    )


# POV-Ray's pictures: which face a pixel sees, written in colours, and radiance at several exposures.
#
# A portable pixmap of 16 bits a channel holds 65535 steps. Colours that shine by themselves carry integers exactly.
# Light is rendered at exposures that grow fourfold, and each value is taken from the longest one that it does not
# saturate, so that it has at least 16383 steps. Each channel has exposures of its own:
# they may be a million million apart.


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


# POV-Ray's `trace()` as an oracle in double precision: the loop over the pixels, and its numbers back.
#
# The scene description language computes in double, asks `trace()` for the first hit along a ray and writes what it
# found as text. So nothing is rounded to a picture's steps.


NUMBERS = "numbers.txt"
# Fixed-point text: 17 digits after the point resolve 1e-17 of POV-Ray's units.
LOOP = f"""#macro Put(V) concat(str(V.x,0,17), " ", str(V.y,0,17), " ", str(V.z,0,17)) #end
#fopen Numbers "{NUMBERS}" write
#for (Row, 0, HEIGHT - 1)
#for (Column, 0, WIDTH - 1)
  #declare Ray = vnormalize(Forward + ((2 * Column + 1) / WIDTH - 1) * Across + (1 - (2 * Row + 1) / HEIGHT) * Along);
  #write (Numbers, Put(Ray))
  HITS
  #write (Numbers, "\\n")
#end
#end
#fclose Numbers
"""
HITS = """#ifdef (Seen)
    #declare Facing = <0,0,0>;
    #declare Place = trace(Seen, Eye, Ray, Facing);
    #if (vdot(Facing, Facing) > 0)
      #write (Numbers, " ", Put(Place), " ", Put(Facing))
      FEELERS
    #end
  #end"""
FEELER = """#declare Other = <0,0,0>;
    #declare Stop = trace(World, Place, LIGHT - Place, Other);
    #if (vdot(Other, Other) > 0 & vlength(Stop - Place) < vlength(LIGHT - Place) - TOLERANCE)
      #write (Numbers, " 0")
    #else
      #write (Numbers, " 1")
    #end"""


@dataclass(frozen=True, kw_only=True)
class Probe:
    """What `trace()` found along the rays through the pixel centres, row by row."""

    direction: np.ndarray  # (n, 3), unit
    hit: np.ndarray  # (n,) bool
    position: np.ndarray  # (n, 3) m, 0 on a miss
    normal: np.ndarray  # (n, 3), unit, outward, 0 on a miss
    free: np.ndarray  # (n, lights) bool: nothing between hit and light, wherever the surface faces


def loop(scene: Scene, *, feelers: bool) -> str:
    """Return the SDL that writes the numbers; it follows the world in the scene file."""
    lights = [vector(np.multiply(light.position, scale_of(scene))) for light in scene.lights] if feelers else []
    # A light on a blocker's surface is not behind it: the tolerance that POV-Ray has at a ray's start, at its end too.
    feeler = FEELER.replace("TOLERANCE", f"{DEPTH_TOLERANCE}")
    hits = HITS.replace("FEELERS", "\n    ".join(feeler.replace("LIGHT", light) for light in lights))
    size = LOOP.replace("WIDTH", str(scene.camera.width)).replace("HEIGHT", str(scene.camera.height))
    return size.replace("HITS", hits)


def read_probe(folder: Path, scene: Scene) -> Probe:
    """Return the numbers that the loop left in `folder`."""
    lines = [line.split() for line in (folder / NUMBERS).read_text(encoding="ascii").splitlines()]
    count = scene.camera.width * scene.camera.height
    if len(lines) != count:
        raise RuntimeError(f"POV-Ray wrote {len(lines)} lines for {count} pixels")
    # Where nothing is hit no line is long, whatever lights there are.
    table = np.zeros((count, 9 + len(scene.lights)))
    for row, words in enumerate(lines):
        table[row, : len(words)] = [float(word) for word in words]
    hit = np.array([len(words) > 3 for words in lines])
    length = np.linalg.norm(table[:, 6:9], axis=1, keepdims=True)
    return Probe(
        direction=table[:, :3],
        hit=hit,
        position=table[:, 3:6] / scale_of(scene),
        normal=np.divide(table[:, 6:9], length, out=np.zeros((count, 3)), where=hit[:, np.newaxis]),
        free=table[:, 9:] > 0,
    )


# From what `trace()` found to the specification's stages, ray by ray.


def stages_of(scene: Scene, probe: Probe, objects: np.ndarray, *, lit: bool) -> StageImages:
    """Return every stage before radiance, ray by ray; those of light only if `lit`.

    `objects` (n, 2) are the shape and face that the picture shows. A pixel at an outline that only one of picture and
    trace() hits counts as missed.
    """
    hit = probe.hit & (objects[:, 0] >= 0)
    objects = np.where(hit[:, np.newaxis], objects, -1.0)
    shape = objects[:, 0].astype(int)
    position, outward = (np.where(hit[:, np.newaxis], rows, 0.0) for rows in (probe.position, probe.normal))
    two_sided = np.array([*(each.two_sided for each in scene.shapes), False])[shape]
    away = np.einsum("ij,ij->i", outward, probe.direction) > 0
    normal = np.where((two_sided & away)[:, np.newaxis], -outward, outward)
    distance = np.linalg.norm(position - np.asarray(scene.camera.eye), axis=1)
    rows: StageImages = {
        Stage.RAY: probe.direction,
        Stage.OBJECT: objects,
        Stage.DISTANCE: np.where(hit, distance, np.inf)[:, np.newaxis],
        Stage.POSITION: position,
        Stage.NORMAL: normal,
    }
    return rows | _lit(scene, probe.free, rows) if lit else rows


def _lit(scene: Scene, free: np.ndarray, given: StageImages) -> StageImages:
    """Return visibility, irradiance and exitance from `free` (n, lights) and the stages before them."""
    shape, position, normal = given[Stage.OBJECT][:, 0].astype(int), given[Stage.POSITION], given[Stage.NORMAL]
    visible = np.zeros((len(shape), len(scene.lights)))
    irradiance = np.zeros((len(shape), 3))
    for number, light in enumerate(scene.lights):
        to_light = np.asarray(light.position) - position
        length = np.linalg.norm(to_light, axis=1)
        facing = np.einsum("ij,ij->i", normal, to_light)
        lighted = (shape >= 0) & (facing > 0) & free[:, number]
        visible[:, number] = lighted
        cosine = np.divide(facing, length, out=np.zeros(len(shape)), where=lighted)
        if scene.shading == "inverse_square":
            cosine = np.divide(cosine, 4 * np.pi * length**2, out=np.zeros(len(shape)), where=lighted)
        irradiance += cosine[:, np.newaxis] * np.asarray(light.flux)
    albedo = np.array([*(each.albedo for each in scene.shapes), (0.0, 0.0, 0.0)])[shape]
    return {
        Stage.VISIBILITY: visible,
        Stage.IRRADIANCE: irradiance,
        Stage.EXITANCE: albedo * irradiance,
    }
