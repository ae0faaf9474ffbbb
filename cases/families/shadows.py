"""Families `shadows` (outlines and clutter before a light) and `along_the_way` (blockers before and behind a light)."""

from collections.abc import Iterator
from math import sqrt

import numpy as np

from rayproof.cases.case import Case, ShadowOutline, covering
from rayproof.cases.placement import camera_around, compose, rotation, scaling, shear, translation
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Camera, Cube, Matrix, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle

# Shadows: outlines known in closed form, blockers that do and do not count, and every kind of shape as a blocker.
ANTI_ACNE = ("LIT-2", "LIT-3", "LIT-4")
FLOOR = Plane(albedo=(0.6, 0.5, 0.7))
X, Y, H = 0.35, -0.25, 3.2  # m; the light is at (X, Y, H)
LIGHT = PointLight(position=(X, Y, H), flux=(350.0, 240.0, 420.0))
EXTENT = 10.0  # m; no coordinate of camera, hit or light is larger
ROUNDINGS = 60  # of camera ray (20), hit (15), its offset (5), shadow ray (10) and the blocker's test (10)


def outlined(name: str, form: str, blocker: Shape, size: float, magnification: float) -> Case:
    """Return the case of one blocker above the floor and the outline of its shadow."""
    camera = camera_around((X, Y, 0.4), distance=6.5, azimuth=-65, elevation=38, width=96, height=72, fovy=42)
    scene = Scene(camera=camera, shapes=(FLOOR, blocker), lights=(LIGHT,))
    return Case(
        name=f"shadows/{name}",
        scene=scene,
        stresses=f"A light straight above: the shadow's outline is a {form} of half-size {size:.4g} m.",
        covers=covering(scene, *ANTI_ACNE),
        least_interior=4000,
        expectations=(
            ShadowOutline(
                shape=0,
                light=0,
                form=form,
                center=(X, Y),
                size=size,
                margin=gamma(ROUNDINGS, precision="float32") * EXTENT * magnification,
                because=f"similar triangles; float32: {ROUNDINGS} roundings of {EXTENT:g} m, times {magnification:.3g}",
            ),
        ),
    )  # fmt: skip


def square_above(a: float, z: float) -> Case:
    """Return the case of a level square of half-size `a` at height `z`."""
    blocker = Square(albedo=(0.3, 0.6, 0.4), to_world=compose(translation(X, Y, z), scaling(2 * a, 2 * a, 1)))
    magnification = H / (H - z)
    return outlined(f"square_at_{z:g}m", "square", blocker, a * magnification, magnification)


def sphere_above(r: float, distance: float) -> Case:
    """Return the case of a sphere of radius `r` whose centre is `distance` below the light."""
    blocker = Sphere(albedo=(0.3, 0.6, 0.4), center=(X, Y, H - distance), radius=r)
    size = H * r / sqrt(distance**2 - r**2)
    return outlined(f"sphere_{distance:g}m_below", "disc", blocker, size, H / (distance - r))


def cluttered() -> Iterator[Case]:
    """Yield scenes with tilted floors and blockers of every kind, without a closed form."""
    floor = Square(
        albedo=(0.6, 0.5, 0.7),
        to_world=compose(translation(0.2, 0.1, -0.6), rotation((0.6, 1.0, 0.2), 9), scaling(8, 7, 1)),
    )
    sphere = Sphere(albedo=(0.7, 0.3, 0.3), center=(0.9, -0.7, 0.5), radius=0.45)
    cube = Cube(
        albedo=(0.3, 0.7, 0.4),
        to_world=compose(translation(-0.7, 0.5, 0.5), rotation((0.4, -0.2, 1.0), 35), scaling(0.7, 0.9, 0.8)),
    )
    square = Square(
        albedo=(0.4, 0.4, 0.8),
        to_world=compose(translation(0.6, 0.9, 0.9), rotation((1.0, 0.3, -0.2), 50), shear(xy=0.4)),
    )
    triangle = Triangle(albedo=(0.8, 0.7, 0.3), vertices=((-1.2, -1.1, 0.4), (-0.1, -1.3, 0.7), (-0.6, -0.3, 1.2)))
    camera = camera_around((0.1, 0.0, 0.1), distance=6.0, azimuth=-40, elevation=36, width=96, height=72, fovy=44)
    light = PointLight(position=(1.6, 0.7, 4.1), flux=(420.0, 380.0, 300.0))
    # It is infinite: it blocks every shadow ray to the light behind it, and none to the other light.
    wall = Plane(albedo=(0.5, 0.6, 0.5), to_world=compose(translation(-1.6, 1.3, 0.0), rotation((0.64, 0.77, 0.0), 84)))
    behind = PointLight(position=(-3.0, 2.4, 2.5), flux=(300.0, 420.0, 380.0))
    for name, stresses, scene, more in (
        (
            "every_blocker",
            "A sphere, a cube, a sheared square and a triangle throw shadows on a tilted floor and on each other.",
            Scene(camera=camera, shapes=(floor, sphere, cube, square, triangle), lights=(light,)),
            ("HIT-5", "HIT-8"),
        ),
        (
            "behind_the_light",
            "Objects behind the light, as the floor sees it, must not count as obstacles.",
            Scene(
                camera=camera,
                shapes=(floor, sphere, cube),
                lights=(PointLight(position=(0.15, -0.1, 0.2), flux=(60.0, 50.0, 80.0)),),
            ),
            (),
        ),
        (
            "behind_a_plane",
            "A plane between everything that is seen and one of two lights.",
            Scene(camera=camera, shapes=(floor, sphere, wall), lights=(behind, light)),
            (),
        ),
    ):
        yield Case(
            name=f"shadows/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene, *ANTI_ACNE, *more),
            least_interior=3500,
        )


def shadows() -> Iterator[Case]:
    """Yield the known outlines, then the cluttered scenes.

    A light straight above at height h casts the shadow of a level square of half-size a at height z as a square of
    half-size a h / (h - z), and that of a sphere of radius r at distance D below it as a disc of radius
    h r / sqrt(D^2 - r^2): similar triangles (Euclid, Elements VI.4) and the tangent cone.
    """
    yield square_above(0.45, 0.6)
    yield square_above(0.3, 1.9)
    yield sphere_above(0.5, 2.2)
    yield sphere_above(0.4, 1.2)
    yield from cluttered()


# Small squares close to the light: before it, as the floor sees it, and behind it.
PLACE = np.array((0.1, -0.2, 3.0))  # of the light [m]
ALONG_THE_WAY_LIGHT = PointLight(position=(0.1, -0.2, 3.0), flux=(500.0, 420.0, 350.0))
CAMERA: Camera = camera_around((0.0, 0.0, 0.0), distance=7.0, azimuth=-50, elevation=38, width=64, height=48, fovy=36)
ALONG_THE_WAY_FLOOR = Square(albedo=(0.6, 0.6, 0.5), to_world=((6, 0, 0, 0), (0, 6, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)))
MIDDLES = ((-1.3, -1.2), (1.3, -1.1), (-1.2, 1.2), (1.2, 1.3))  # of the shadows, x and y on the floor [m]
WIDTH = 0.9  # m, of each shadow
BEFORE = (0.9, 0.99, 0.999, 0.9999)
BEHIND = (1.1, 1.01, 1.001, 1.0001)


def _parallel(share: float, middle: tuple[float, float]) -> Matrix:
    """Return the matrix of a square parallel to the floor, at `share` of the way to the light, by its shadow's middle.

    Squares behind the light would cast this shadow if they were before it.
    """
    ground = np.array((*middle, 0.0))
    x, y, z = (ground + share * (PLACE - ground)).tolist()
    size = WIDTH * abs(1 - share)
    return ((size, 0.0, 0.0, x), (0.0, size, 0.0, y), (0.0, 0.0, 1.0, z), (0.0, 0.0, 0.0, 1.0))


def along_the_way() -> Iterator[Case]:
    """Yield four squares before the light, then four behind it.

    Before the light they cast a shadow as large as that of a square halfway; behind it they cast none. Their distances
    run from 0.9 to 0.9999, and from 1.0001 to 1.1, of the distance to the light.
    """
    for name, shares, stresses in (
        ("before_the_light", BEFORE, "Squares at 0.9 to 0.9999 of the way to the light throw their whole shadow."),
        ("behind_the_light", BEHIND, "Squares at 1.0001 to 1.1 of the way to the light throw none."),
    ):
        squares = tuple(
            Square(albedo=(0.4, 0.5, 0.7), to_world=_parallel(share, middle), two_sided=True)
            for share, middle in zip(shares, MIDDLES, strict=True)
        )
        scene = Scene(camera=CAMERA, shapes=(ALONG_THE_WAY_FLOOR, *squares), lights=(ALONG_THE_WAY_LIGHT,))
        yield Case(
            name=f"along_the_way/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene),
            least_interior=1200,
        )
