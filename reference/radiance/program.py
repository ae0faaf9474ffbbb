"""Starting Radiance's programs: oconv makes an octree, rtrace follows rays; its output becomes hits and stages.

Source: the manual pages oconv(1) and rtrace(1) of Radiance 6.0, and the package pyradiance that contains the programs.
"""

import os
import re
import subprocess
import sys
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import version as installed_version
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rayproof.cases.scene import PointLight, Scene, Sphere
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.radiance import scene
from rayproof.reference.radiance.scene import FTINY, centers, discs, interval, parts, radius, scale, surfaces, through

# No jitter, no substructuring, all shadows tested (-dt 0 -dc 1: by default rtrace estimates some), no ambient light,
# faint contributions included. -w suppresses warnings; an error still ends the program.
OPTIONS = (
    *("-h", "-w", "-n", "1", "-fdd", "-ab", "0", "-av", "0", "0", "0"),
    *("-dj", "0", "-dt", "0", "-dc", "1", "-ds", "0", "-dr", "0", "-lr", "0", "-lw", "0", "-st", "0"),
)
CROWD = "64"  # most surfaces in a box that oconv leaves whole; with its own 6, nested meshes take megabytes
NUMBER = 8  # bytes
# Text amid binary: a name ends at a tab, its ten numbers follow.
HIT = re.compile(rb"([^\t]+)\t(.{%d})" % (10 * NUMBER), re.DOTALL)


@lru_cache(maxsize=1)
def folder() -> Path | None:
    """Return the folder of pyradiance's programs and their library, or None if it is not installed."""
    specification = find_spec("pyradiance")
    return Path(specification.origin).parent if specification is not None and specification.origin is not None else None


def missing() -> str | None:
    """Return a sentence with the reason why the programs cannot be started, or None if they can."""
    home = folder()
    if home is None:
        return "Radiance is not installed; pip install pyradiance."
    absent = [name for name in ("oconv", "rtrace") if not os.access(_program(home, name), os.X_OK)]
    return f"pyradiance carries no {' and no '.join(absent)} for this machine." if absent else None


@lru_cache(maxsize=1)
def version() -> str:
    """Return program, its version and the package that contains it."""
    version_text = _run("rtrace", "-version").decode().strip().removeprefix("RADIANCE ")
    return f"Radiance rtrace {version_text} (pyradiance {installed_version('pyradiance')})"


def octree(place: Path, name: str, text: str) -> None:
    """Write a scene's `text` as `name`.rad, and its octree, into the folder `place`.

    The octree names the scene's file and rtrace reads both: a frozen octree would keep 31 bits of each number.
    """
    (place / f"{name}.rad").write_text(text, encoding="ascii")
    (place / f"{name}.oct").write_bytes(_run("oconv", "-n", CROWD, f"{name}.rad", place=place))


def radiances(place: Path, name: str, rays: np.ndarray, limited: bool) -> np.ndarray:
    """Return the radiance (n, 3) along `rays`, (n, 6) origins and directions, in the scene `name`.

    `limited` rays end at the tips of their direction vectors.
    """
    data = _trace(place, name, rays, "-ov", limited=limited)
    if len(data) != len(rays) * 3 * NUMBER:
        raise RuntimeError(f"rtrace answered {len(data)} bytes to {len(rays)} rays")
    return np.frombuffer(data, dtype="<f8").reshape(len(rays), 3)


def first_hits(place: Path, name: str, rays: np.ndarray, limited: bool) -> tuple[list[bytes], np.ndarray]:
    """Return the name of the surface that each ray meets first, "*" for none, and ten numbers (n, 10).

    These are the ray's unit direction, the distance to the hit (1e10 for none), its position and its normal.
    """
    data = _trace(place, name, rays, "-osdLpN", limited=limited)
    records = HIT.findall(data)
    names, numbers = [name for name, _ in records], b"".join([ten for _, ten in records])
    # Bytes between two records make the sum too small.
    if len(records) != len(rays) or len(records) + len(b"".join(names)) + len(numbers) != len(data):
        raise RuntimeError(f"rtrace's answer to {len(rays)} rays holds {len(records)} hits in {len(data)} bytes")
    return names, np.frombuffer(numbers, dtype="<f8").reshape(-1, 10)


def _trace(place: Path, name: str, rays: np.ndarray, output: str, *, limited: bool) -> bytes:
    limit = "-ld+" if limited else "-ld-"
    data = np.ascontiguousarray(rays, dtype="<f8").tobytes()
    return _run("rtrace", *OPTIONS, limit, output, f"{name}.oct", place=place, data=data)


def _run(program: str, *arguments: str, place: Path | None = None, data: bytes = b"") -> bytes:
    """Return the output of a program; raise RuntimeError with its message if it fails."""
    home = folder()
    if home is None:
        raise RuntimeError(missing())
    # Nothing of the user's own Radiance settings (RAYPATH, .rtracerc) takes part.
    environment = {"PATH": str(home / "bin"), "RAYPATH": str(home / "lib"), "LC_ALL": "C"}
    if sys.platform == "win32":
        environment["SYSTEMROOT"] = os.environ.get("SYSTEMROOT", "")
    command = [str(_program(home, program)), *arguments]
    done = subprocess.run(command, input=data, capture_output=True, env=environment, cwd=place, check=False)
    if done.returncode != 0:
        message = done.stderr.decode(errors="replace").strip().splitlines()
        raise RuntimeError(f"{program} ended with {done.returncode}: {message[-1] if message else 'it said nothing'}")
    return done.stdout


def _program(home: Path, name: str) -> Path:
    return home / "bin" / (f"{name}.exe" if sys.platform == "win32" else name)


# Results of rtrace along rays: first hits in a scene without light, radiances in a scene with one light.


# How far above a surface, in rtrace's units, its irradiance is read: more than it overlooks at a ray's start.
LIFT = 8 * FTINY
# Names of the folder's scenes: the finite shapes, all shapes, all shapes and a light. A plane's disc is so much larger
# than everything else that it must not be sorted into the same octree.
FINITE, ALL, LIT = "finite", "all", "lit"


@dataclass(frozen=True, kw_only=True)
class RtraceRays:
    """Rays from the eye: unit directions (n, 3), and from where to where [m] along them hits count, (n,) each."""

    direction: np.ndarray
    start: np.ndarray
    end: np.ndarray


@dataclass(frozen=True, kw_only=True)
class RtraceHits:
    """The first hits; misses have shape and face -1, distance inf, and zeros elsewhere."""

    direction: np.ndarray  # (n, 3), unit, as rtrace normalised it
    shape: np.ndarray  # (n,) index into the scene's shapes
    face: np.ndarray  # (n,)
    distance: np.ndarray  # (n,) m from the eye
    position: np.ndarray  # (n, 3) m
    normal: np.ndarray  # (n, 3), unit, as the surface is oriented


class RtraceScene:
    """A scene in rtrace's units and language, in a temporary folder, as a context.

    Its finite shapes are sorted into one octree; the other scenes contain an instance of it.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, self.scale = scene, scale(scene)
        self._folder = TemporaryDirectory(prefix="rayproof-radiance-")

    def __enter__(self) -> "RtraceScene":
        try:
            self._write(FINITE, [*scene.painted(self.scene), *surfaces(self.scene, self.scale)])
            self._write(ALL, self._shapes("void"))
        except BaseException:
            self._folder.cleanup()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    def hits(self, rays: RtraceRays) -> RtraceHits:
        """Return the first hits of the rays."""
        hits = self._met(rays)
        # rtrace solves a sphere's quadratic from the ray's origin and loses the square of its distance over the radius
        # in roundings; so a hit on a sphere is computed again, from a distance of its radius.
        radii = [radius(shape) if isinstance(shape, Sphere) else 0.0 for shape in self.scene.shapes]
        lead = np.array([*radii, 0.0])[hits.shape]
        again = np.flatnonzero((lead > 0) & (hits.distance - lead > rays.start))
        if len(again):
            near = hits.distance[again] - lead[again]
            closer = self._met(RtraceRays(direction=rays.direction[again], start=near, end=near + 2 * lead[again]))
            # At the outline of a shape one may miss it and the other hit it.
            same = closer.shape == hits.shape[again]
            for name in ("distance", "position", "normal"):
                getattr(hits, name)[again[same]] = getattr(closer, name)[same]
        return hits

    def _met(self, rays: RtraceRays) -> RtraceHits:
        names, columns = first_hits(self._place, ALL, *self._rows(rays))
        numbers = {name: _numbers(name.decode("ascii")) for name in set(names)}
        shape, face = np.array([numbers[name] for name in names], dtype=int).reshape(-1, 2).T
        hit = shape >= 0
        return RtraceHits(
            direction=columns[:, 0:3],
            shape=shape,
            face=face,
            distance=np.where(hit, rays.start + columns[:, 3] / self.scale, np.inf),
            position=np.where(hit[:, np.newaxis], columns[:, 4:7] / self.scale, 0.0),
            normal=np.where(hit[:, np.newaxis], columns[:, 7:10], 0.0),
        )

    def irradiance(self, light: PointLight, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Return E [1/m^2] of `light` per watt of its flux at `position` [m] on the side of `normal`, (n,).

        It is read off a white surface, seen from closely above.
        """
        self._illuminate(light, scene.WHITE, paint="white")
        rows = np.hstack([position * self.scale + LIFT * normal, -2 * LIFT * normal])
        return radiances(self._place, LIT, rows, True)[:, 0] * (np.pi * self.per_watt)

    def radiance(self, light: PointLight, portions: Iterable[RtraceRays]) -> Iterator[np.ndarray]:
        """Yield the radiance [W/(m^2 sr)] of only `light` along rays, (n, 3) for each portion of them."""
        if not any(light.flux):
            return
        # Fractions and powers of two, because any flux is right and float32 cannot represent every one.
        fractions, exponents = np.frexp(light.flux)
        self._illuminate(light, fractions.tolist(), paint="void")
        for rays in portions:
            values = radiances(self._place, LIT, *self._rows(rays))
            yield np.ldexp(values * self.per_watt, exponents)

    @property
    def per_watt(self) -> float:
        """Return the intensity [1/sr] of one watt over the intensity of the scene's light, per squared metre."""
        return self.scale**2 / (4 * np.pi) / scene.INTENSITY

    @property
    def _place(self) -> Path:
        return Path(self._folder.name)

    def _illuminate(self, light: PointLight, color: Sequence[float], *, paint: str) -> None:
        """Make the scene with this one light, `paint` over every shape, or their own albedo ("void")."""
        self._write(LIT, [*scene.light(light, color, self.scale), *self._shapes(paint)])

    def _shapes(self, paint: str) -> list[str]:
        """Return all shapes under `paint`, or under their own materials."""
        rings = [f"{f'm{i}' if paint == 'void' else paint} {disc}" for i, disc in discs(self.scene, self.scale)]
        finite = [f"{paint} instance finite 1 ./{FINITE}.oct 0 0"] if len(rings) < len(self.scene.shapes) else []
        return [scene.WHITE_PAINT, *scene.painted(self.scene), *finite, *rings]

    def _write(self, name: str, lines: Iterable[str]) -> None:
        octree(self._place, name, "\n".join([*lines, ""]))

    def _rows(self, rays: RtraceRays) -> tuple[np.ndarray, bool]:
        """Return origins and directions in rtrace's units, (n, 6), and whether the rays end at the directions' tips."""
        origin = (np.asarray(self.scene.camera.eye) + rays.start[:, np.newaxis] * rays.direction) * self.scale
        limited = bool(np.isfinite(rays.end).all())
        length = (rays.end - rays.start) * self.scale if limited else np.ones_like(rays.start)
        return np.hstack([origin, rays.direction * length[:, np.newaxis]]), limited


def _numbers(name: str) -> tuple[int, int]:
    """Return shape and face from a surface's name."""
    if name == "*":
        return -1, -1
    shape, _, face = name.removeprefix("s").partition(".")
    return int(shape), int(face)


# From rtrace's hits and radiances to the specification's stages.


LIT_STAGES = (Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE)


def single(scene: Scene, world: RtraceScene, stages: Collection[Stage]) -> StageImages:
    """Return the stages from ray to exitance that are among `stages`, (height, width, channels), float64."""
    hits = world.hits(_rays(scene, *centers(scene.camera)))
    normal = _shading_normals(scene, hits)
    images: dict[Stage, np.ndarray] = {
        Stage.RAY: hits.direction,
        Stage.OBJECT: np.column_stack([hits.shape, hits.face]).astype(np.float64),
        Stage.DISTANCE: hits.distance[:, np.newaxis],
        Stage.POSITION: hits.position,
        Stage.NORMAL: normal,
    }
    if set(LIT_STAGES) & set(stages):
        images |= _lit(scene, world, hits, normal)
    size = (scene.camera.height, scene.camera.width)
    return {stage: rows.reshape(*size, rows.shape[1]) for stage, rows in images.items() if stage in stages}


def image(scene: Scene, world: RtraceScene, samples: int) -> np.ndarray:
    """Return the mean radiance [W/(m^2 sr)] over samples x samples points per pixel, (height, width, 3)."""
    pixels = scene.camera.height * scene.camera.width
    total = np.zeros((pixels, 3))
    for light in scene.lights:
        for values in world.radiance(light, _portions(scene, samples)):
            total += values.reshape(-1, pixels, 3).sum(axis=0)
    return (total / samples**2).reshape(scene.camera.height, scene.camera.width, 3)


def _portions(scene: Scene, samples: int) -> Iterator[RtraceRays]:
    for x, y in parts(scene.camera, samples):
        yield _rays(scene, x, y)


def _rays(scene: Scene, x: np.ndarray, y: np.ndarray) -> RtraceRays:
    direction, cosine = through(scene.camera, x, y)
    start, end = interval(scene, cosine)
    return RtraceRays(direction=direction, start=start, end=end)


def _lit(scene: Scene, world: RtraceScene, hits: RtraceHits, normal: np.ndarray) -> dict[Stage, np.ndarray]:
    """Return visibility, irradiance and exitance."""
    hit = np.flatnonzero(hits.shape >= 0)
    visibility = np.zeros((len(hits.shape), len(scene.lights)))
    irradiance = np.zeros((len(hits.shape), 3))
    for number, light in enumerate(scene.lights):
        arriving = world.irradiance(light, hits.position[hit], normal[hit])
        visibility[hit, number] = arriving > 0
        irradiance[hit] += arriving[:, np.newaxis] * light.flux
    albedo = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])
    return {
        Stage.VISIBILITY: visibility,
        Stage.IRRADIANCE: irradiance,
        Stage.EXITANCE: albedo[hits.shape] * irradiance,
    }


def _shading_normals(scene: Scene, hits: RtraceHits) -> np.ndarray:
    """Return the specification's N: outward, and on two-sided shapes towards the viewer."""
    two_sided = np.array([*(shape.two_sided for shape in scene.shapes), False])[hits.shape]
    away = (hits.normal * hits.direction).sum(axis=1) > 0
    return np.where((two_sided & away)[:, np.newaxis], -hits.normal, hits.normal)
