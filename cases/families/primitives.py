"""Families `primitives`, `alone` (one body that shades itself) and `antialiased` (several samples per pixel)."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, UniformValue, covering
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle, Vector
from rayproof.cases.stages import Stage

# Each primitive by itself, untransformed: a failure here is one of the primitive's own intersection or normal.
ALBEDO = (0.75, 0.5, 0.3)
LIGHT = PointLight(position=(2.1, -1.4, 3.3), flux=(310.0, 220.0, 420.0))
# A skew tetrahedron: counter-clockwise seen from outside.
TETRAHEDRON = np.array(((-0.9, -0.7, -0.6), (1.1, -0.5, -0.4), (-0.1, 1.2, -0.5), (0.15, -0.1, 1.05)))
OUTWARD = np.array(((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)))
TRIANGLE = ((-1.1, -0.6, 0.2), (1.2, -0.4, -0.3), (-0.2, 0.9, 0.8))

# Name, shape, further items, least interior pixels (of 96 x 72).
PRIMITIVES: tuple[tuple[str, Shape, tuple[str, ...], int], ...] = (
    ("sphere", Sphere(albedo=ALBEDO, center=(0.2, -0.1, 0.15), radius=0.85), (), 2000),
    ("cube", Cube(albedo=ALBEDO), (), 1300),
    ("square", Square(albedo=ALBEDO), ("HIT-8",), 420),
    ("plane", Plane(albedo=ALBEDO), (), 6000),
    ("triangle", Triangle(albedo=ALBEDO, vertices=TRIANGLE), ("HIT-5",), 1300),
    ("mesh", Mesh(albedo=ALBEDO, vertices=TETRAHEDRON, faces=OUTWARD), ("HIT-5", "LIT-2", "LIT-4"), 1300),
)  # fmt: skip


def primitives() -> Iterator[Case]:
    """Yield one case per primitive."""
    camera = camera_around((0.1, 0.05, 0.1), distance=4.2, azimuth=-52, elevation=33, width=96, height=72, fovy=29)
    for name, shape, more, least_interior in PRIMITIVES:
        scene = Scene(camera=camera, shapes=(shape,), lights=(LIGHT,))
        yield Case(
            name=f"primitives/{name}",
            scene=scene,
            stresses=f"A {name} alone, without a transform: its intersection, its normal and its irradiance.",
            covers=covering(scene, "CAM-5", *more),
            least_interior=least_interior,
        )


# A single body that blocks its own light: no other shape can be the blocker.
ALONE_ALBEDO = (0.6, 0.45, 0.7)
FLUX = (420.0, 510.0, 360.0)  # W
OUTSIDE: Vector = (0.9, -2.9, 3.1)
# A valley between two slopes, the higher one towards the light.
VALLEY = np.array(
    ((-1.6, -1.2, 1.1), (1.5, -1.1, 1.2), (1.4, 0.1, -0.2), (-1.5, -0.1, -0.1), (1.6, 1.5, 0.5), (-1.4, 1.6, 0.4))
)
SLOPES = np.array(((0, 2, 3), (0, 1, 2), (3, 4, 5), (3, 2, 4)))


def alone() -> Iterator[Case]:
    """Yield a two-sided ball and box seen from within and lit from outside, then a valley that shades itself."""
    within = camera_around((0.1, 0.0, -0.1), distance=0.7, azimuth=25, elevation=-20, width=56, height=42, fovy=70)
    placed = compose(translation(0.1, 0.1, 0.0), rotation((0.3, 0.7, -0.4), 27))
    ball = Sphere(albedo=ALONE_ALBEDO, center=(0.1, 0.05, -0.1), radius=1.9, two_sided=True)
    box = Cube(albedo=ALONE_ALBEDO, to_world=compose(placed, scaling(3.1, 2.9, 3.3)), two_sided=True)
    dark: tuple[tuple[str, str, Shape], ...] = (
        ("two_sided_sphere", "Inside a two-sided sphere, the light outside: its own wall keeps all light out.", ball),
        ("two_sided_cube", "Inside a two-sided cube, the light outside: its own wall keeps all light out.", box),
    )
    light = PointLight(position=OUTSIDE, flux=FLUX)
    for name, stresses, body in dark:
        scene = Scene(camera=within, shapes=(body,), lights=(light,))
        yield Case(
            name=f"alone/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene),
            least_interior=1500,
            expectations=tuple(_black(channel) for channel in range(3)),
        )
    above: Camera = camera_around(
        (0.0, 0.2, 0.2), distance=2.1, azimuth=80, elevation=52, width=64, height=48, fovy=92
    )  # fmt: skip
    valley = Mesh(albedo=ALONE_ALBEDO, vertices=VALLEY, faces=SLOPES)
    low = PointLight(position=(0.3, -3.4, 2.1), flux=FLUX)
    scene = Scene(camera=above, shapes=(valley,), lights=(low,))
    yield Case(
        name="alone/concave_mesh",
        scene=scene,
        stresses="A valley, the light low behind its higher slope: half of it lies in its own shadow.",
        covers=covering(scene),
        least_interior=800,
    )


def _black(channel: int) -> UniformValue:
    return UniformValue(
        stage=Stage.RADIANCE, shape=0, channel=channel, value=0.0, relative=0.0, because="its wall is before the light"
    )


# Pixels as averages: 8 x 8 samples on a regular grid against the box filter of an image renderer.
SAMPLES = 8  # per side of a pixel
FLOOR = Square(
    albedo=(0.6, 0.5, 0.4),
    to_world=compose(translation(0.1, 0.2, -0.9), rotation((0.8, 0.5, 0.1), 10), scaling(7, 6, 1)),
)


def antialiased() -> Iterator[Case]:
    """Yield a round and an angular object over a floor."""
    sphere = Sphere(albedo=(0.3, 0.6, 0.8), center=(0.2, -0.1, 0.1), radius=0.8)
    cube = Cube(
        albedo=(0.8, 0.4, 0.3),
        to_world=compose(translation(0.0, 0.1, 0.2), rotation((0.3, 0.6, 1.0), 48), scaling(1.2, 1.0, 1.1)),
    )
    camera = camera_around((0.0, 0.0, 0.0), distance=5.0, azimuth=-44, elevation=37, width=24, height=18, fovy=36)
    light = PointLight(position=(1.8, -1.2, 3.0), flux=(350.0, 420.0, 300.0))
    solids: tuple[tuple[str, Shape], ...] = (("sphere", sphere), ("cube", cube))
    for name, solid in solids:
        scene = Scene(camera=camera, shapes=(FLOOR, solid), lights=(light,))
        yield Case(
            name=f"antialiased/{name}",
            scene=scene,
            stresses=f"A {name} and its shadow with 64 samples in every pixel: outlines become averages.",
            covers=covering(scene, "LIT-4"),
            least_interior=200,
            samples=SAMPLES,
        )
