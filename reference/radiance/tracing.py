"""What rtrace finds along rays: first hits in a scene without light, radiances in a scene with one light."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from cases.scene import Plane, PointLight, Scene
from reference.radiance import materials, programs
from reference.radiance.extents import FTINY, extent, reach, scale
from reference.radiance.shapes import surfaces

# How far above a surface, in rtrace's units, its irradiance is read: more than it overlooks at a ray's start.
LIFT = 8 * FTINY
# oconv's usual number of cells along the octree's edge; a plane's disc around the scene asks for finer ones.
CELLS = 2**14
MOST_CELLS = 2**30
# What the folder's scenes are called: the shapes alone, and those with a light.
SHAPES, LIT = "shapes", "lit"


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


def cells(scene: Scene) -> int:
    """Return how many cells the octree may have along an edge."""
    around = max(1.0, reach(scene) / extent(scene)) if any(isinstance(shape, Plane) for shape in scene.shapes) else 1.0
    return int(min(CELLS * 2.0 ** np.ceil(np.log2(around)), MOST_CELLS))


class World:
    """A scene in rtrace's units and language, in a temporary folder, as a context.

    Its shapes are sorted into one octree, which the scenes with a light hold as an instance.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, self.scale = scene, scale(scene)
        self._folder = TemporaryDirectory(prefix="rayproof-radiance-")

    def __enter__(self) -> "World":
        try:
            text = "\n".join([*materials.painted(self.scene), *surfaces(self.scene, self.scale), ""])
            programs.octree(self._place, SHAPES, text, cells(self.scene))
        except BaseException:
            self._folder.cleanup()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    def hits(self, rays: Rays) -> Hits:
        """Return what the rays meet first."""
        names, found = programs.first_hits(self._place, SHAPES, *self._rows(rays))
        numbers = {name: _numbers(name.decode("ascii")) for name in set(names)}
        shape, face = np.array([numbers[name] for name in names], dtype=int).T
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
        return programs.radiances(self._place, LIT, rows, True)[:, 0] * (np.pi * self._per_watt)

    def radiance(self, light: PointLight, portions: Iterable[Rays]) -> Iterator[np.ndarray]:
        """Yield the radiance [W/(m^2 sr)] that `light` alone gives along rays, (n, 3) for each portion of them."""
        largest = max(light.flux)
        if largest == 0:
            return
        # As a fraction of the largest, because any flux is right and float32 does not hold every one.
        self._illuminate(light, [channel / largest for channel in light.flux], paint="void")
        for rays in portions:
            yield programs.radiances(self._place, LIT, *self._rows(rays)) * (largest * self._per_watt)

    @property
    def _per_watt(self) -> float:
        """Return the intensity [1/sr] of one watt over that of the light in the scene, per squared metre."""
        return self.scale**2 / (4 * np.pi) / materials.INTENSITY

    @property
    def _place(self) -> Path:
        return Path(self._folder.name)

    def _illuminate(self, light: PointLight, color: Sequence[float], *, paint: str) -> None:
        """Make the scene with this one light, `paint` over every shape, or their own albedo ("void")."""
        shapes = [f"{paint} instance shapes 1 ./{SHAPES}.oct 0 0"] if self.scene.shapes else []
        lamp = materials.light(light, color, self.scale)
        programs.octree(self._place, LIT, "\n".join([materials.WHITE_PAINT, *lamp, *shapes, ""]), CELLS)

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
