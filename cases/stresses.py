"""Scenes on which formulas differ (`rayproof compare`), with no limits: contact, deep, tangent, grazing, slivers.

Formulas that are mathematically right may fail here in floating point, so these scenes have no limits. They are used
when two formulas are compared or priced. To add a family: a function without parameters that yields (name, scene), in
this module, under `@STRESSES.register("family", slots=(...))`; `slots` are the tracer's slots whose formulas differ
here. Scenes of one family are replicates: the same difficulty, seen from different places.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from math import atan, degrees

import numpy as np

from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation, vector
from rayproof.cases.registry import Registry
from rayproof.cases.scene import Camera, Cube, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle, Vector

STRESSES: Registry[Callable[[], Iterator[tuple[str, Scene]]]] = Registry("stress", package="rayproof.cases.stresses")

WIDTH, HEIGHT = 64, 48  # px
ALBEDO = (0.75, 0.5, 0.3)
LIGHT = PointLight(position=(3.0, -2.0, 4.0), flux=(300.0, 200.0, 400.0))
VIEWS = ((20.0, 30.0), (115.0, -25.0), (200.0, 55.0), (290.0, 5.0), (335.0, -50.0))  # degrees: azimuth, elevation


def stressing(slot: str) -> tuple[str, ...]:
    """Return the stress families on which formulas of `slot` differ."""
    return tuple(name for name in STRESSES if slot in STRESSES.about(name)["slots"])


# Blockers a thousandth of the scene's scale above a floor, from a tenth of a millimetre to a thousand kilometres.
#
# A shadow ray that starts too high leaks light under the blocker; one that starts too low shadows itself.


GAP = 2.0**-10  # of the scale


def contact(scale: float) -> Iterator[tuple[str, Scene]]:
    """Yield a tile that hovers GAP above a floor of the given scale [m], lit from the side."""
    for number, (azimuth, elevation) in enumerate(((20.0, 30.0), (115.0, 50.0), (200.0, 20.0)), start=1):
        away = (0.3 * scale, -0.2 * scale, 0.7 * scale)
        tile = Square(
            albedo=ALBEDO,
            two_sided=True,
            to_world=compose(
                translation(away[0], away[1], away[2] + GAP * scale), scaling(0.5 * scale, 0.5 * scale, 1.0)
            ),
        )
        camera = camera_around(
            away,
            distance=2.0 * scale,
            azimuth=azimuth,
            elevation=elevation,
            width=WIDTH,
            height=HEIGHT,
            near=0.01 * scale,
            far=100.0 * scale,
        )
        floor = Plane(albedo=ALBEDO, to_world=translation(*away))
        light = PointLight(position=(1.3 * scale, 0.4 * scale, 2.7 * scale), flux=(scale**2, scale**2, scale**2))
        yield f"view_{number}", Scene(camera=camera, shapes=(floor, tile), lights=(light,))


CONTACT_SLOTS = ("shadow_ray", "segment", "obstructed", "horizon", "falloff", "lambert")


for _label, _scale in (("1e-4", 1e-4), ("1", 1.0), ("1e6", 1e6)):
    STRESSES.register(f"contact_{_label}", slots=CONTACT_SLOTS)(partial(contact, _scale))


# View frusta with a ratio of far to near plane of 1e4 and 1e8, with the eye off the origin.
DEEP_SLOTS = ("ray", "half_extent", "basis", "view", "projection", "inverse", "corners")


def deep(ratio: float) -> Iterator[tuple[str, Scene]]:
    """Yield a sphere seen through a frustum of far / near = `ratio`."""
    for number, (azimuth, elevation) in enumerate(VIEWS, start=1):
        camera = camera_around(
            (0.5, -0.25, 0.125),
            distance=6.0,
            azimuth=azimuth,
            elevation=elevation,
            width=WIDTH,
            height=HEIGHT,
            near=16.0 / ratio,
            far=16.0,
        )
        yield f"view_{number}", Scene(camera=camera, shapes=(Sphere(albedo=ALBEDO),), lights=(LIGHT,))


for _label, _ratio in (("1e4", 1e4), ("1e8", 1e8)):
    STRESSES.register(f"deep_{_label}", slots=DEEP_SLOTS)(partial(deep, _ratio))


# Shapes of size 1 m from ever farther away, framed to fill the image.
#
# B^2 - 4 A C and its like subtract squares that grow with (distance / size)^2 while their difference stays near one, so
# float32 has nothing left at 4096 sizes. Source: Haines, Günther and Akenine-Möller, "Precision Improvements for
# Ray/Sphere Intersection", Ray Tracing Gems (2019), chapter 7.


DISTANCES = {"1e1": 1e1, "1e3": 1e3, "1e5": 1e5}  # m
CORNERS = ((-1.0, -0.75, 0.25), (0.875, -0.5, -0.5), (0.125, 1.0, 0.375))  # m
MARGIN = 1.15  # of the image's half-height over the shape's reach
SHAPES: dict[str, tuple[Shape, tuple[str, ...]]] = {
    "sphere": (Sphere(albedo=ALBEDO), ("sphere", "sphere_normal", "position")),
    "cube": (Cube(albedo=ALBEDO), ("cube", "cube_normal", "position")),
    "square": (Square(albedo=ALBEDO, two_sided=True), ("square", "position")),
    "triangle": (Triangle(albedo=ALBEDO, vertices=CORNERS, two_sided=True), ("triangle", "position")),
}  # fmt: skip


def framed(shape: Shape, distance: float) -> Iterator[tuple[str, Scene]]:
    """Yield the scenes of a shape about the origin, seen from `distance` [m] in several directions."""
    for number, (azimuth, elevation) in enumerate(VIEWS, start=1):
        camera = camera_around(
            (0.0, 0.0, 0.0),
            distance=distance,
            azimuth=azimuth,
            elevation=elevation,
            width=WIDTH,
            height=HEIGHT,
            fovy=2 * degrees(atan(MARGIN / distance)),
            near=distance / 10,
            far=distance * 10,
        )
        yield f"view_{number}", Scene(camera=camera, shapes=(shape,), lights=(LIGHT,))


for _kind, (_shape, _slots) in SHAPES.items():
    for _label, _distance in DISTANCES.items():
        STRESSES.register(f"far_{_kind}_{_label}", slots=_slots)(partial(framed, _shape, _distance))


# Rays that all but miss: along a sphere's outline, and almost parallel to a plane.
GRAZING_DISTANCE = 8.0  # m
WINDOW = 2.0**-10  # rad: half the image's height, at the outline
SLOPES = (0.03125, 0.0078125, 0.00390625, 0.001953125, 0.0009765625)  # 1: eye's height over distance


def looking(eye: Vector, target: Vector, *, fovy: float) -> Camera:
    """Return a camera from `eye` to `target` [m] with `fovy` degrees and an up that is parallel to no axis."""
    return Camera(
        eye=eye, target=target, up=(0.2, 0.1, 1.0), fovy=fovy, width=WIDTH, height=HEIGHT, near=0.125, far=1024.0
    )


@STRESSES.register("tangent_sphere", slots=("sphere", "sphere_normal"))
def tangent_sphere() -> Iterator[tuple[str, Scene]]:
    """Yield a thin window across the outline of a unit sphere, all rays within 2^-10 rad of it."""
    generator = np.random.default_rng(20260)
    for number, _ in enumerate(VIEWS, start=1):
        outward, sideways = np.linalg.qr(generator.normal(size=(3, 2)))[0].T
        # The tangent point of the cone from the eye: 1/D along the axis, sqrt(1 - 1/D^2) across.
        point = outward / GRAZING_DISTANCE + sideways * np.sqrt(1 - 1 / GRAZING_DISTANCE**2)
        camera = looking(vector(outward * GRAZING_DISTANCE), vector(point), fovy=2 * degrees(WINDOW))
        yield f"outline_{number}", Scene(camera=camera, shapes=(Sphere(albedo=ALBEDO),), lights=(LIGHT,))


@STRESSES.register("grazing_plane", slots=("plane", "position"))
def grazing_plane() -> Iterator[tuple[str, Scene]]:
    """Yield the plane z = 0 under ever flatter rays."""
    for slope in SLOPES:
        camera = looking((GRAZING_DISTANCE, 1.0, slope * GRAZING_DISTANCE), (0.0, 0.0, 0.0), fovy=degrees(slope))
        yield f"slope_{slope:g}", Scene(camera=camera, shapes=(Plane(albedo=ALBEDO),), lights=(LIGHT,), clip="none")


@STRESSES.register("grazing_square", slots=("square",))
def grazing_square() -> Iterator[tuple[str, Scene]]:
    """Yield the unit square under ever flatter rays."""
    for name, scene in grazing_plane():
        yield name, replace(scene, shapes=(Square(albedo=ALBEDO, two_sided=True),))


# Triangles a thousand and a hundred thousand times longer than high, across the view and off all axes.
SLIVER_DISTANCE = 4.0  # m


def slivers(aspect: float) -> Iterator[tuple[str, Scene]]:
    """Yield slivers of length 2 m and height 2 m / aspect in random planes, in images as high as they are."""
    generator = np.random.default_rng(20261)
    for number, _ in enumerate(VIEWS, start=1):
        along, across, outward = np.linalg.qr(generator.normal(size=(3, 3)))[0].T
        corners = (-along, along, 0.25 * along + 2 * across / aspect)
        middle = across * 2 / 3 / aspect
        eye = middle + outward * SLIVER_DISTANCE + along * 0.5
        camera = Camera(
            eye=vector(eye),
            target=vector(middle),
            up=vector(across),
            # As high as the sliver: most rays hit it or pass within its height.
            fovy=float(np.degrees(1.5 * 2 / aspect / SLIVER_DISTANCE)),
            width=WIDTH,
            height=HEIGHT,
            near=0.125,
            far=1024.0,
        )
        first, second, third = map(vector, corners)
        shape = Triangle(albedo=ALBEDO, vertices=(first, second, third), two_sided=True)
        yield f"sliver_{number}", Scene(camera=camera, shapes=(shape,), lights=(LIGHT,))


for _label, _aspect in (("1e3", 1e3), ("1e5", 1e5)):
    STRESSES.register(f"sliver_{_label}", slots=("triangle",))(partial(slivers, _aspect))


# Spheres and cubes squeezed by a hundred and by ten thousand along a skew axis: model matrices that lose digits.
def squeezed(ratio: float) -> Iterator[tuple[str, Scene]]:
    """Yield a sphere or a cube, `ratio` times thinner along one axis than along another."""
    for number, (azimuth, elevation) in enumerate(VIEWS, start=1):
        matrix = compose(rotation((0.3, -0.5, 1.0), 37.0 * number), scaling(1.0, 0.5, 1.0 / ratio))
        shape = (Sphere if number % 2 else Cube)(albedo=ALBEDO, to_world=matrix)
        camera = camera_around(
            (0.0, 0.0, 0.0),
            distance=6.0,
            azimuth=azimuth,
            elevation=elevation,
            width=WIDTH,
            height=HEIGHT,
            fovy=degrees(0.4),
        )
        yield f"view_{number}", Scene(camera=camera, shapes=(shape,), lights=(LIGHT,))


SQUEEZED_SLOTS = ("to_object", "world_normal", "position", "cube", "sphere")


for _label, _ratio in (("1e2", 1e2), ("1e4", 1e4)):
    STRESSES.register(f"squeezed_{_label}", slots=SQUEEZED_SLOTS)(partial(squeezed, _ratio))
