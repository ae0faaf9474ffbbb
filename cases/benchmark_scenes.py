"""The benchmark's scenes: bumpy balls, mountains, a city, thousands of spheres; at any size, with one light or four.

Renderers are timed on these scenes, and judged on some of them (`cases.families.trees`). Their meshes have any size:
balls (bumpy, scanned, of slivers and tiny triangles), rods, hills, mountains, a city, and a soup of triangles.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from rayproof.cases.placement import compose, rotation, scaling, translation, unit, vector
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, PointLight, Rgb, Scene, Shape, Sphere, Vector

ALBEDO: Rgb = (0.7, 0.5, 0.3)
SEED = 6
HEIGHTS = "sample_data/jacksboro_fault_dem.npz"
EARTH = 6_371_000.0  # m, mean radius


@lru_cache(maxsize=1)
def bumpy(subdivisions: int) -> Mesh:
    """Return a subdivided icosahedron (20 x 4^subdivisions triangles) with bumps of three sizes, about 1 m across."""
    vertices, faces = _icosphere(subdivisions)
    x, y, z = vertices.T
    coarse = 0.15 * np.sin(7 * x + 1) * np.sin(9 * y) * np.sin(8 * z + 2)
    fine = 0.03 * np.sin(31 * x) * np.sin(29 * y + 1) * np.sin(33 * z)
    return _mesh(vertices * (1 + coarse + fine)[:, np.newaxis], faces)


@lru_cache(maxsize=1)
def uneven(count: int) -> Mesh:
    """Return about `count` triangles of one ball: long slivers from pole to pole, and a cap of tiny ones.

    A tree that splits space or triangles evenly is at its worst here.
    """
    slivers = count // 2
    longitudes = np.linspace(0, 2 * np.pi, slivers // 2 + 1)[:-1]
    rings = [_ring(longitudes, latitude) for latitude in (-1.2, 0.0, 1.2)]
    vertices = np.concatenate(rings)
    n = len(longitudes)
    this, following = np.arange(n), np.roll(np.arange(n), -1)
    lower = np.concatenate(
        [np.stack([this, following, this + n], 1), np.stack([following, following + n, this + n], 1)]
    )
    faces = np.concatenate([lower, lower + n])
    cap, triangles = _icosphere(max(1, round(np.log2(max(1, count // 2 / 20)) / 2)), radius=0.15)
    tiny = cap + np.array([0.35, -0.7, 0.75])
    return _mesh(np.concatenate([vertices, tiny]), np.concatenate([faces, triangles + len(vertices)]))


@lru_cache(maxsize=1)
def scanned(subdivisions: int) -> Mesh:
    """Return a ball as a scanner delivers it: noisy, with holes, its triangles in no order."""
    random = np.random.default_rng(SEED)
    vertices, faces = _icosphere(subdivisions)
    x, y, z = vertices.T
    shape = 1 + 0.2 * np.sin(3 * x) * np.cos(4 * y + z)
    noise = 0.15 * np.sqrt(4 * np.pi / len(faces)) * random.normal(size=len(x))  # of a triangle's size
    centers = vertices[faces].mean(axis=1)
    holes = (np.sin(9 * centers[:, 0]) * np.sin(8 * centers[:, 1]) * np.sin(7 * centers[:, 2])) > 0.7
    return _mesh(vertices * (shape + noise)[:, np.newaxis], random.permutation(faces[~holes]))


@lru_cache(maxsize=1)
def rods(count: int) -> Mesh:
    """Return `count` triangles, two for each thin flat rod; the rods lie in all directions, in a cube of 2 m."""
    random = np.random.default_rng(SEED)
    middle = random.uniform(-1, 1, (count // 2, 3))
    along = unit(random.normal(size=middle.shape))
    across = unit(np.cross(along, random.normal(size=middle.shape)))
    along *= random.uniform(0.15, 0.4, (len(middle), 1))
    across *= random.uniform(0.002, 0.006, (len(middle), 1))
    corners = np.stack([middle - along - across, middle + along - across, middle + along + across], axis=1)
    others = np.stack([corners[:, 0], corners[:, 2], middle - along + across], axis=1)
    return _apart(np.concatenate([corners, others]))


@lru_cache(maxsize=1)
def terrain(cells: int) -> Mesh:
    """Return hills on 12 m by 12 m, 2 cells^2 triangles; seen along the ground most of them hide behind others."""
    across = np.linspace(-6, 6, cells + 1)
    x, y = np.meshgrid(across, across, indexing="ij")
    waves = [0.35 / k * np.sin(0.9 * k * x + k * k) * np.cos(0.8 * k * y + 2 * k) for k in (1, 2, 4, 8, 16)]
    z = np.sum(waves, axis=0)
    return _grid(x, y, z)


def unmeasured() -> str | None:
    """Return a sentence if the data of `mountains` are missing, or None. Imports nothing."""
    file = _heights()
    return None if file is not None and file.exists() else f"Matplotlib's sample data has no {HEIGHTS} here."


@lru_cache(maxsize=1)
def mountains() -> Mesh:
    """Return measured mountains near Jacksboro in Tennessee: 275 772 triangles, 32 km scaled to 12 m.

    Heights are whole metres, so that valleys have steps. Source: the Shuttle Radar Topography Mission, three seconds of
    arc apart, in Matplotlib's sample data.

    Raises:
        FileNotFoundError: the sample data are missing; `unmeasured` returns this as a sentence.

    """
    file = _heights()
    if file is None or not file.exists():
        raise FileNotFoundError(unmeasured())
    with np.load(file) as measured:
        height = measured["elevation"].astype(np.float64)
        north = np.radians(np.linspace(measured["ymin"], measured["ymax"], height.shape[0]))
        east = np.radians(np.linspace(measured["xmin"], measured["xmax"], height.shape[1]))
    metre = 12 / (EARTH * np.ptp(north))
    # Columns go east and rows south, from the upper left corner.
    x, y = np.meshgrid(EARTH * np.cos(north.mean()) * (east - east.mean()), EARTH * (north - north.mean()))
    return _grid(*(np.ascontiguousarray(axis.T[:, ::-1]) * metre for axis in (x, y, height - height.min())))


def _heights() -> Path | None:
    """Return the path of Matplotlib's file of heights, which need not exist; None without Matplotlib."""
    package = find_spec("matplotlib")
    return None if package is None or package.origin is None else Path(package.origin).parent / "mpl-data" / HEIGHTS


def _grid(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> Mesh:
    """Return the surface through points (m, n) [m], whose rows go along x and columns along y, seen from above."""
    across, along = x.shape
    corner = (np.arange(across - 1)[:, np.newaxis] * along + np.arange(along - 1)).ravel()
    right, above = corner + along, corner + 1
    faces = np.concatenate([np.stack([corner, right, right + 1], 1), np.stack([corner, right + 1, above], 1)])
    return _mesh(np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), faces)


@lru_cache(maxsize=1)
def city(blocks: int) -> Mesh:
    """Return blocks^2 houses on a ground of 12 m by 12 m: boxes without floors, ten triangles each, in rows."""
    random = np.random.default_rng(SEED)
    place = (np.arange(blocks) + 0.5) * 12 / blocks - 6
    x, y = (grid.ravel() for grid in np.meshgrid(place, place, indexing="ij"))
    half = random.uniform(0.2, 0.42, (2, len(x))) * 12 / blocks
    height = 0.15 + 0.25 * random.exponential(size=len(x))
    around = np.array(((-1, -1), (1, -1), (1, 1), (-1, 1)))
    below = np.stack(
        [
            x[:, np.newaxis] + half[0, :, np.newaxis] * around[:, 0],
            y[:, np.newaxis] + half[1, :, np.newaxis] * around[:, 1],
            np.zeros((len(x), 4)),
        ],
        axis=2,
    )
    above = below + height[:, np.newaxis, np.newaxis] * (0, 0, 1)
    vertices = np.concatenate([below, above], axis=1).reshape(-1, 3)
    walls = [face for k in range(4) for face in ((k, (k + 1) % 4, (k + 1) % 4 + 4), (k, (k + 1) % 4 + 4, k + 4))]
    box = np.array([*walls, (4, 5, 6), (4, 6, 7)])
    faces = (8 * np.arange(len(x))[:, np.newaxis, np.newaxis] + box).reshape(-1, 3)
    ground = np.array(((-6, -6, 0), (6, -6, 0), (6, 6, 0), (-6, 6, 0)))
    corners = len(vertices) + np.array(((0, 1, 2), (0, 2, 3)))
    return _mesh(np.concatenate([vertices, ground]), np.concatenate([faces, corners]))


@lru_cache(maxsize=1)
def soup(count: int) -> Mesh:
    """Return `count` small triangles that share no vertex, anywhere in a ball of 1 m and turned in any way."""
    random = np.random.default_rng(SEED)
    places = unit(random.normal(size=(count, 3))) * np.cbrt(random.uniform(0, 1, (count, 1)))
    return _apart(places[:, np.newaxis] + 0.006 * random.normal(size=(count, 3, 3)))


def _apart(corners: np.ndarray) -> Mesh:
    """Return a mesh of triangles (n, 3, 3) [m] that share no vertex."""
    return _mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def _icosphere(subdivisions: int, *, radius: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices [m] and faces of a subdivided icosahedron."""
    import trimesh  # here, because it takes most of a second and most scenes have no mesh

    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return np.asarray(ball.vertices), np.asarray(ball.faces)


def _ring(longitudes: np.ndarray, latitude: float) -> np.ndarray:
    return np.stack(
        [
            np.cos(latitude) * np.cos(longitudes),
            np.cos(latitude) * np.sin(longitudes),
            np.full_like(longitudes, np.sin(latitude)),
        ],
        axis=1,
    )


def _mesh(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    return Mesh(albedo=ALBEDO, two_sided=True, vertices=vertices.astype(np.float32), faces=faces.astype(np.int32))


SIZES = ((512, 512), (1920, 1080))  # px
QUICK_SIZES = ((512, 512),)
LIGHTS = (
    PointLight(position=(2.5, -3.0, 7.0), flux=(3000.0, 2000.0, 4000.0)),
    PointLight(position=(-4.0, -5.0, 5.0), flux=(1500.0, 1500.0, 1000.0)),
    PointLight(position=(5.0, 2.0, 6.0), flux=(800.0, 1200.0, 1600.0)),
    PointLight(position=(0.5, -6.0, 3.0), flux=(600.0, 500.0, 400.0)),
)
FLOOR = Plane(albedo=(0.3, 0.4, 0.8), two_sided=True)


@dataclass(frozen=True, kw_only=True)
class BenchScene:
    """A scene of the benchmark, made when it is needed: the large ones would fill the memory together."""

    name: str
    about: str
    shapes: Callable[[], tuple[Shape, ...]]
    view: tuple[Vector, Vector]  # eye, target [m]
    lights: int = 1
    quick: bool = False  # small enough for --quick
    missing: Callable[[], str | None] = lambda: None  # a sentence why it cannot be made here, or None

    def scene(self, width: int, height: int) -> Scene:
        """Return the scene at a size [px]."""
        camera = Camera(
            eye=self.view[0],
            target=self.view[1],
            up=(0.0, 0.0, 1.0),
            fovy=40.0,
            width=width,
            height=height,
            near=0.01,
            far=1000.0,
        )
        return Scene(camera=camera, shapes=self.shapes(), lights=LIGHTS[: self.lights])


def _sphere_and_floor() -> tuple[Shape, ...]:
    return (Sphere(albedo=(0.7, 0.5, 0.3), two_sided=True, center=(0.0, 0.0, 1.0)), FLOOR)


def _spheres_and_cubes() -> tuple[Shape, ...]:
    random = np.random.default_rng(1)
    shapes: list[Shape] = []
    for index in range(20):
        x, y, z = vector(random.uniform((-2.5, -2.5, 0.3), (2.5, 2.5, 2.0)))
        size, turn = float(random.uniform(0.2, 0.5)), float(random.uniform(0, 360))
        if index < 10:
            shapes.append(Sphere(albedo=(0.7, 0.5, 0.3), two_sided=True, center=(x, y, z), radius=size))
        else:
            axis = vector(random.normal(size=3))
            placed = compose(translation(x, y, z), rotation(axis, turn), scaling(*[1.5 * size] * 3))
            shapes.append(Cube(albedo=(0.3, 0.5, 0.7), two_sided=True, to_world=placed))
    return tuple(shapes)


def _thousand_spheres() -> tuple[Shape, ...]:
    random = np.random.default_rng(2)
    places = random.uniform((-3.0, -3.0, 0.0), (3.0, 3.0, 3.0), size=(1000, 3))
    radii = random.uniform(0.03, 0.15, size=1000)
    return tuple(
        Sphere(albedo=(0.7, 0.5, 0.3), two_sided=True, center=vector(place), radius=float(radius))
        for place, radius in zip(places, radii, strict=True)
    )


EyeAndTarget = tuple[Vector, Vector]  # [m]
WIDE: EyeAndTarget = ((3.0, -6.0, 3.5), (0.1, 0.2, 0.5))
NEAR: EyeAndTarget = ((1.5, -3.0, 1.2), (0.0, 0.0, 0.0))
LOW: EyeAndTarget = ((0.5, -5.8, 0.9), (0.0, 0.0, 0.3))  # along the ground
VALLEY: EyeAndTarget = ((0.5, -5.8, 0.9), (0.0, -1.5, 0.0))  # over the foothills

SCENES: tuple[BenchScene, ...] = (
    BenchScene(name="sphere_and_floor", about="1 sphere + floor", shapes=_sphere_and_floor, view=WIDE, quick=True),
    BenchScene(
        name="sphere_and_floor_4_lights",
        about="the same, 4 lights",
        shapes=_sphere_and_floor,
        view=WIDE,
        lights=4,
        quick=True,
    ),
    BenchScene(
        name="spheres_and_cubes", about="10 spheres + 10 cubes", shapes=_spheres_and_cubes, view=WIDE, quick=True
    ),
    BenchScene(name="thousand_spheres", about="1000 spheres", shapes=_thousand_spheres, view=WIDE, quick=True),
    BenchScene(name="bumpy_1k", about="bumpy ball, 1 280 triangles", shapes=lambda: (bumpy(3),), view=NEAR, quick=True),
    BenchScene(
        name="bumpy_20k", about="bumpy ball, 20 480 triangles", shapes=lambda: (bumpy(5),), view=NEAR, quick=True
    ),
    BenchScene(name="bumpy_20k_4_lights", about="the same, 4 lights", shapes=lambda: (bumpy(5),), view=NEAR, lights=4),
    BenchScene(
        name="uneven", about="slivers beside crumbs, 20 000 triangles", shapes=lambda: (uneven(20_000),), view=NEAR
    ),
    BenchScene(
        name="scanned", about="noisy ball with holes, 82 000 triangles", shapes=lambda: (scanned(6),), view=NEAR
    ),
    BenchScene(
        name="rods", about="thin rods in all directions, 20 000 triangles", shapes=lambda: (rods(20_000),), view=NEAR
    ),
    BenchScene(
        name="city", about="1600 houses along the ground, 16 002 triangles", shapes=lambda: (city(40),), view=LOW
    ),
    BenchScene(
        name="terrain", about="hills along the ground, 320 000 triangles", shapes=lambda: (terrain(400),), view=LOW
    ),
    BenchScene(
        name="mountains",
        about="mountains as radar measured them, 275 772 triangles",
        shapes=lambda: (mountains(),),
        view=VALLEY,
        missing=unmeasured,
    ),
    BenchScene(name="soup", about="a million triangles in no order", shapes=lambda: (soup(1_000_000),), view=NEAR),
    BenchScene(name="bumpy_330k", about="bumpy ball, 327 680 triangles", shapes=lambda: (bumpy(7),), view=NEAR),
    BenchScene(name="bumpy_1300k", about="bumpy ball, 1 310 720 triangles", shapes=lambda: (bumpy(8),), view=NEAR),
)


def chosen(names: tuple[str, ...], *, quick: bool) -> tuple[BenchScene, ...]:
    """Return the scenes called `names`, or all (of the quick ones); raise LookupError for an unknown name."""
    scenes = {scene.name: scene for scene in SCENES}
    for name in names:
        if name not in scenes:
            raise LookupError(f"no bench scene is called {name!r}; known: {', '.join(scenes)}")
    return tuple(scene for scene in SCENES if (scene.name in names if names else scene.quick or not quick))
