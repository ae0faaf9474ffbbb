"""The benchmark's scenes, from one sphere to a million triangles, at any size and with one light or four."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rayproof.cases.benchmark.meshes import bumpy, city, mountains, rods, scanned, soup, terrain, uneven, unmeasured
from rayproof.cases.placement import compose, rotation, scaling, translation
from rayproof.cases.scene import Camera, Cube, Plane, PointLight, Scene, Shape, Sphere, Vector

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
        x, y, z = (float(value) for value in random.uniform((-2.5, -2.5, 0.3), (2.5, 2.5, 2.0)))
        size, turn = float(random.uniform(0.2, 0.5)), float(random.uniform(0, 360))
        if index < 10:
            shapes.append(Sphere(albedo=(0.7, 0.5, 0.3), two_sided=True, center=(x, y, z), radius=size))
        else:
            axis = tuple(map(float, random.normal(size=3)))
            placed = compose(
                translation(x, y, z), rotation((axis[0], axis[1], axis[2]), turn), scaling(*[1.5 * size] * 3)
            )
            shapes.append(Cube(albedo=(0.3, 0.5, 0.7), two_sided=True, to_world=placed))
    return tuple(shapes)


def _thousand_spheres() -> tuple[Shape, ...]:
    random = np.random.default_rng(2)
    places = random.uniform((-3.0, -3.0, 0.0), (3.0, 3.0, 3.0), size=(1000, 3))
    radii = random.uniform(0.03, 0.15, size=1000)
    return tuple(
        Sphere(albedo=(0.7, 0.5, 0.3), two_sided=True, center=(float(x), float(y), float(z)), radius=float(radius))
        for (x, y, z), radius in zip(places, radii, strict=True)
    )


View = tuple[Vector, Vector]  # eye, target [m]
WIDE: View = ((3.0, -6.0, 3.5), (0.1, 0.2, 0.5))
NEAR: View = ((1.5, -3.0, 1.2), (0.0, 0.0, 0.0))
LOW: View = ((0.5, -5.8, 0.9), (0.0, 0.0, 0.3))  # along the ground
VALLEY: View = ((0.5, -5.8, 0.9), (0.0, -1.5, 0.0))  # over the foothills

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
    known = {scene.name: scene for scene in SCENES}
    for name in names:
        if name not in known:
            raise LookupError(f"no bench scene is called {name!r}; known: {', '.join(known)}")
    return tuple(scene for scene in SCENES if (scene.name in names if names else scene.quick or not quick))
