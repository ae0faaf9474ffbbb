"""What rtrace finds along rays: first hits in a scene without light, radiances in a scene with one light."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rayproof.cases.scene import PointLight, Scene, Sphere
from rayproof.reference.radiance import materials, programs
from rayproof.reference.radiance.extents import FTINY, scale
from rayproof.reference.radiance.shapes import discs, radius, surfaces

# How far above a surface, in rtrace's units, its irradiance is read: more than it overlooks at a ray's start.
LIFT = 8 * FTINY
# What the folder's scenes are called: the finite shapes, all shapes, all shapes and a light. A plane's disc is so much
# larger than everything else that it must not be sorted into the same octree.
FINITE, ALL, LIT = "finite", "all", "lit"


@dataclass(frozen=True, kw_only=True)
class Rays:
    """Rays from the eye: unit directions (n, 3), and from where to where [m] along them hits count, (n,) each."""

    direction: np.ndarray
    start: np.ndarray
    end: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Hits:
    """The first hits; misses have shape and face -1, distance inf, and zeros elsewhere."""

    direction: np.ndarray  # (n, 3), unit, as rtrace normalised it
    shape: np.ndarray  # (n,) index into the scene's shapes
    face: np.ndarray  # (n,)
    distance: np.ndarray  # (n,) m from the eye
    position: np.ndarray  # (n, 3) m
    normal: np.ndarray  # (n, 3), unit, as the surface is oriented


class World:
    """A scene in rtrace's units and language, in a temporary folder, as a context.

    Its finite shapes are sorted into one octree, of which the other scenes hold an instance.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, self.scale = scene, scale(scene)
        self._folder = TemporaryDirectory(prefix="rayproof-radiance-")

    def __enter__(self) -> "World":
        try:
            self._write(FINITE, [*materials.painted(self.scene), *surfaces(self.scene, self.scale)])
            self._write(ALL, self._shapes("void"))
        except BaseException:
            self._folder.cleanup()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    def hits(self, rays: Rays) -> Hits:
        """Return what the rays meet first."""
        hits = self._met(rays)
        # rtrace solves a sphere's quadratic from the ray's origin and loses the square of its distance over the radius
        # in roundings; so a sphere that was met is asked about again, from as far off as its radius.
        radii = [radius(shape) if isinstance(shape, Sphere) else 0.0 for shape in self.scene.shapes]
        lead = np.array([*radii, 0.0])[hits.shape]
        again = np.flatnonzero((lead > 0) & (hits.distance - lead > rays.start))
        if len(again):
            near = hits.distance[again] - lead[again]
            closer = self._met(Rays(direction=rays.direction[again], start=near, end=near + 2 * lead[again]))
            # At its limb one may miss what the other meets.
            same = closer.shape == hits.shape[again]
            for name in ("distance", "position", "normal"):
                getattr(hits, name)[again[same]] = getattr(closer, name)[same]
        return hits

    def _met(self, rays: Rays) -> Hits:
        names, found = programs.first_hits(self._place, ALL, *self._rows(rays))
        numbers = {name: _numbers(name.decode("ascii")) for name in set(names)}
        shape, face = np.array([numbers[name] for name in names], dtype=int).reshape(-1, 2).T
        hit = shape >= 0
        return Hits(
            direction=found[:, 0:3],
            shape=shape,
            face=face,
            distance=np.where(hit, rays.start + found[:, 3] / self.scale, np.inf),
            position=np.where(hit[:, np.newaxis], found[:, 4:7] / self.scale, 0.0),
            normal=np.where(hit[:, np.newaxis], found[:, 7:10], 0.0),
        )

    def irradiance(self, light: PointLight, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Return E [1/m^2] of `light` per watt of its flux at `position` [m] on the side of `normal`, (n,).

        It is read off a white surface, seen from closely above.
        """
        self._illuminate(light, materials.WHITE, paint="white")
        rows = np.hstack([position * self.scale + LIFT * normal, -2 * LIFT * normal])
        return programs.radiances(self._place, LIT, rows, True)[:, 0] * (np.pi * self.per_watt)

    def radiance(self, light: PointLight, portions: Iterable[Rays]) -> Iterator[np.ndarray]:
        """Yield the radiance [W/(m^2 sr)] that `light` alone gives along rays, (n, 3) for each portion of them."""
        if not any(light.flux):
            return
        # Fractions and powers of two, because any flux is right and float32 does not hold every one.
        fractions, exponents = np.frexp(light.flux)
        self._illuminate(light, fractions.tolist(), paint="void")
        for rays in portions:
            found = programs.radiances(self._place, LIT, *self._rows(rays))
            yield np.ldexp(found * self.per_watt, exponents)

    @property
    def per_watt(self) -> float:
        """Return the intensity [1/sr] of one watt over that of the light in the scene, per squared metre."""
        return self.scale**2 / (4 * np.pi) / materials.INTENSITY

    @property
    def _place(self) -> Path:
        return Path(self._folder.name)

    def _illuminate(self, light: PointLight, color: Sequence[float], *, paint: str) -> None:
        """Make the scene with this one light, `paint` over every shape, or their own albedo ("void")."""
        self._write(LIT, [*materials.light(light, color, self.scale), *self._shapes(paint)])

    def _shapes(self, paint: str) -> list[str]:
        """Return all shapes under `paint`, or under their own materials."""
        rings = [f"{f'm{i}' if paint == 'void' else paint} {disc}" for i, disc in discs(self.scene, self.scale)]
        finite = [f"{paint} instance finite 1 ./{FINITE}.oct 0 0"] if len(rings) < len(self.scene.shapes) else []
        return [materials.WHITE_PAINT, *materials.painted(self.scene), *finite, *rings]

    def _write(self, name: str, lines: Iterable[str]) -> None:
        programs.octree(self._place, name, "\n".join([*lines, ""]))

    def _rows(self, rays: Rays) -> tuple[np.ndarray, bool]:
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
