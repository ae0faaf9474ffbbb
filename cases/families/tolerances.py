"""Family `tolerances`: tiny scenes, and rays and lights that almost graze, in which no tolerance may be visible.

The audit's mutants add tolerances of 1e-2 to 1e-8 to comparisons that need none, which the other families did not find.
Shapes close to the origin have small coordinates and so small roundings: float32 resolves them better than elsewhere.
"""

from collections.abc import Callable, Iterator
from math import asin, atan2, cos, hypot, sin

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.placement import compose, rotation, scaling, translation
from rayproof.cases.scene import (
    Camera,
    Cube,
    Mesh,
    Plane,
    PointLight,
    Rgb,
    Scene,
    Shape,
    Sphere,
    Square,
    Triangle,
    Vector,
)

WHITE: Rgb = (1.0, 0.9, 0.8)
TINY = 2.0**-26  # m, 1.5e-8
SLIT = 2.0**-28  # m
TETRAHEDRON = ((0.6, 0.6, 0.6), (0.6, -0.6, -0.6), (-0.6, 0.6, -0.6), (-0.6, -0.6, 0.6))
SPIKE = ((0.0, 0.0, 0.9), (0.5, -0.4, -0.5), (-0.3, 0.6, -0.5), (-0.5, -0.5, -0.4))
SIDES = ((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2))
BITS = np.array([[(corner >> axis) & 1 for axis in range(3)] for corner in range(8)]) - 0.5
BOX = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
BOX_SIDES = np.array([(face[0], face[k], face[k + 1]) for face in BOX for k in (1, 2)])


def _camera(
    eye: Vector,
    target: Vector,
    *,
    near: float,
    far: float,
    up: Vector = (0.0, 0.0, 1.0),
    fovy: float = 40.0,
    size: tuple[int, int] = (56, 44),
) -> Camera:
    width, height = size
    return Camera(eye=eye, target=target, up=up, fovy=fovy, width=width, height=height, near=near, far=far)


def _light(place: Vector, irradiance: float, distance: float, color: Rgb = WHITE) -> PointLight:
    """Return a light that gives an irradiance [W/m^2] at a distance [m]."""
    red, green, blue = (irradiance * 4 * np.pi * distance**2 * part for part in color)
    return PointLight(position=place, flux=(red, green, blue))


def _times(unit: float, *numbers: float) -> Vector:
    x, y, z = (unit * number for number in numbers)
    return x, y, z


def slit() -> Scene:
    """Return a floor under a ceiling so close that every tolerance is larger; a lamp inside, another one above."""
    ceiling = compose(scaling(SLIT, SLIT, SLIT), translation(0, 0, 1), scaling(30, 30, 30))
    return Scene(
        camera=_camera(_times(SLIT, 0, -0.9, 0.7), (0.0, 0.0, 0.0), near=0.1 * SLIT, far=100 * SLIT),
        shapes=(
            Square(albedo=(0.7, 0.5, 0.3), to_world=scaling(30 * SLIT, 30 * SLIT, 30 * SLIT)),
            Square(albedo=(0.5, 0.5, 0.5), to_world=ceiling),
        ),
        lights=(
            _light((0.3, 0.2, 1.0), 3.0, 1.0, (0.2, 0.6, 1.0)),
            _light(_times(SLIT, 0.2, 0.3, 0.5), 2.0, 0.6 * SLIT),
        ),
    )


def crumbs() -> Scene:
    """Return shapes of each kind, two meshes, squares that almost touch, and a buried lamp, all a few 1e-8 m large."""
    place = lambda x, y, z: compose(scaling(TINY, TINY, TINY), translation(x, y, z))  # noqa: E731
    turned = rotation((0.3, 0.5, 0.8), 40)
    corners = np.array([*TETRAHEDRON, (-2e3, -2e3, -2.0), (2e3, -2e3, -2.0), (0.0, 3e3, -2.0)])
    shapes: tuple[Shape, ...] = (
        Plane(albedo=(0.6, 0.6, 0.5), to_world=place(0, 0, -0.65)),
        Cube(albedo=(0.8, 0.4, 0.3), to_world=compose(place(-1.5, 1.0, 0.0), turned)),
        Sphere(albedo=(0.3, 0.5, 0.8), to_world=compose(place(1.5, 1.1, 0.0), scaling(0.6, 0.6, 0.6))),
        # Two almost touching squares: first with the later one above, then with the earlier one above.
        Square(albedo=(0.3, 0.8, 0.6), two_sided=True, to_world=place(0, 1.2, 0.0)),
        Square(albedo=(0.9, 0.3, 0.6), two_sided=True, to_world=place(-0.5, 1.2, 2e-4)),
        Square(albedo=(0.3, 0.4, 0.9), two_sided=True, to_world=place(0.5, 1.2, -2e-4)),
        Triangle(
            albedo=(0.7, 0.7, 0.2),
            vertices=(_times(TINY, -0.6, -0.5, 0.0), _times(TINY, 0.7, -0.4, 0.2), _times(TINY, 0.0, 0.6, 0.1)),
        ),
        # A sheet that is much larger than the other faces, under the floor.
        Mesh(
            albedo=(0.5, 0.8, 0.4),
            vertices=corners,
            faces=np.array([*SIDES, (4, 5, 6)]),
            to_world=compose(place(-1.4, -0.8, 0.0), scaling(0.8, 0.8, 0.8)),
        ),
        Mesh(
            albedo=(0.4, 0.6, 0.8),
            vertices=np.array([*SPIKE, *corners[4:]]),
            faces=np.array(SIDES),
            to_world=compose(place(1.4, -0.8, 0.0), scaling(0.8, 0.8, 0.8)),
        ),
    )
    return Scene(
        camera=_camera(_times(TINY, 0.3, -3.0, 3.6), (0.0, 0.0, 0.0), near=4.0 * TINY, far=6.6 * TINY),
        shapes=shapes,
        lights=(
            _light(_times(TINY, 1.5, -3.0, 5.0), 3.0, 6 * TINY),
            _light(_times(TINY, 0.2, -0.5, -0.75), 3.0, 2 * TINY, (1.0, 0.3, 0.2)),
        ),
    )


def lamp() -> Scene:
    """Return a lamp 1e-4 m over a floor with a shade before it and one behind it, 9e-5 of the way."""
    unit, gap = 1e-4, 9e-5
    shades = tuple(
        Square(
            albedo=(0.5, 0.5, 0.5),
            two_sided=True,
            to_world=compose(translation(x * unit, 0, z * unit), scaling(size * unit, size * unit, size * unit)),
        )
        for x, z, size in ((0.2 * gap, 1 - gap, gap), (0.0, 1 + gap, 1.0))
    )
    floor = Square(albedo=(0.7, 0.6, 0.4), to_world=scaling(4 * unit, 4 * unit, unit))
    return Scene(
        camera=_camera(_times(unit, 1.57, -2.93, 4.0), _times(unit, 0, 0, 0.2), near=0.1 * unit, far=20 * unit),
        shapes=(floor, *shades),
        lights=(_light(_times(unit, 0, 0, 1), 3.0, unit),),
    )


def _skimmed(*shapes: Shape) -> Scene:
    """Return shapes seen through a telescope at 5e-5 to 1e-4 rad above z = 0."""
    height = 5e-5  # m
    return Scene(
        camera=_camera(
            (0.0, 0.0, height), (1.0, 0.0, -0.5 * height), fovy=0.003, size=(64, 48), near=0.5 * height, far=50.0
        ),
        shapes=shapes,
        lights=(_light((0.7, 0.3, 3.0), 3.0, 3.0),),
    )


def skimmed_square() -> Scene:
    """Return a square."""
    return _skimmed(Square(albedo=(0.8, 0.5, 0.3), to_world=compose(translation(0.8, 0, 0), scaling(1.2, 1.2, 1.2))))


def skimmed_mesh() -> Scene:
    """Return the lid of a box of triangles, whose diagonal passes outside the image."""
    box = compose(translation(0.8, 0.4, -0.6), scaling(1.2, 1.2, 1.2))
    return _skimmed(Mesh(albedo=(0.8, 0.8, 0.3), vertices=BITS, faces=BOX_SIDES, to_world=box))


def skimmed_cube() -> Scene:
    """Return a cube."""
    return _skimmed(Cube(albedo=(0.8, 0.5, 0.3), to_world=compose(translation(0.8, 0, -0.6), scaling(1.2, 1.2, 1.2))))


def skimmed_plane() -> Scene:
    """Return a plane."""
    return _skimmed(Plane(albedo=(0.3, 0.4, 0.6)))


def hall() -> Scene:
    """Return the inside of a cube of 1e7 m, so that every direction in its object space is short."""
    size = 1e7  # m
    return Scene(
        camera=_camera(_times(size, 0.1, -0.3, 0.47), _times(size, 0.0, 0.45, 0.45), fovy=80.0, near=1.0, far=3 * size),
        shapes=(Cube(albedo=(0.8, 0.5, 0.3), two_sided=True, to_world=scaling(size, size, size)),),
        lights=(_light(_times(size, 0.2, 0.0, 0.3), 3.0, 0.5 * size),),
    )


def on_axis() -> Scene:
    """Return a sphere and boxes of triangles seen along an axis: a ray meets each where its bounding box ends."""
    return Scene(
        camera=_camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), size=(61, 45), near=0.1, far=50.0),
        shapes=(
            Sphere(albedo=(0.8, 0.5, 0.3)),
            Mesh(albedo=(0.4, 0.6, 0.8), vertices=BITS, faces=BOX_SIDES, to_world=translation(1.75, 0.25, 0.0)),
            Mesh(albedo=(0.5, 0.8, 0.4), vertices=BITS * 1.2, faces=BOX_SIDES, to_world=translation(-1.75, -0.25, 0.0)),
        ),
        lights=(_light((1.5, 2.0, 5.0), 3.0, 5.0), _light((-2.0, -1.0, 4.0), 1.0, 4.0, (0.3, 0.5, 1.0))),
    )


def low_light() -> Scene:
    """Return a floor lit from 4e-5 rad above it."""
    return Scene(
        camera=_camera((0.0, -2.0, 1.5), (0.0, 0.0, 0.0), near=0.1, far=50.0),
        shapes=(Plane(albedo=(0.7, 0.5, 0.3)),),
        lights=(_light((2.0, 0.3, 8e-5), 2e5, 2.0),),
    )


def rim() -> Scene:
    """Return a sphere's outline through a telescope: chords whose halves are a hundredth of the radius and less.

    The coordinates of the centre are half a step of 16 bits away from numbers with 16 bits, in opposite directions.
    """
    center = (2.000031, 3.46414, 0.0)
    right = atan2(center[1], center[0]) - asin(1 / hypot(center[0], center[1]))  # the direction of a tangent ray
    return Scene(
        camera=_camera((0.0, 0.0, 0.0), (4 * cos(right), 4 * sin(right), 0.0), fovy=0.012, near=0.1, far=50.0),
        shapes=(Sphere(albedo=(0.8, 0.5, 0.3), center=center),),
        lights=(_light((6.0, 0.5, 2.0), 3.0, 6.0),),
    )


def uneven() -> Scene:
    """Return fields whose numbers have all their digits and are larger than usual: `up`, angle, planes, albedos.

    Each is almost half a step of 16 bits away from a number with 16 bits.
    """
    near, far = 1.2346031, 345.6755  # m
    ahead, aside, upward = np.array(((0.6, 0.64, -0.48), (0.8, -0.48, 0.36), (0.0, 0.6, 0.8)))

    def wall(depth: float, x: float, y: float, albedo: Rgb) -> Shape:
        """Return a square of the size of its depth that faces the camera."""
        middle = depth * (ahead + x * aside + y * upward)
        rows = np.column_stack([depth * aside, depth * upward, -ahead, middle]).tolist()
        first, second, third = (tuple(row) for row in rows)
        return Square(albedo=albedo, two_sided=True, to_world=(first, second, third, (0.0, 0.0, 0.0, 1.0)))

    corners = [300.0 * (ahead + x * aside + y * upward) for x, y in ((-0.5, -0.9), (0.6, -0.8), (0.1, 1.1))]
    return Scene(
        camera=_camera(
            (0.0, 0.0, 0.0),
            _times(7.654321, *ahead),
            up=(96.59472, 225.3925, 206.0743),
            fovy=131.2362,
            near=near,
            far=far,
        ),
        shapes=(
            *(wall(near * (1 + share), -1.3, y, (1.7, 2.3, 0.9)) for y, share in ((-0.8, 4e-6), (0.8, -4e-6))),
            *(wall(far * (1 + share), 1.4, y, (0.9, 1.4, 2.6)) for y, share in ((-0.8, 4e-6), (0.8, -4e-6))),
            Triangle(albedo=(2.1, 1.2, 0.7), two_sided=True, vertices=(corners[0], corners[1], corners[2])),  # pyright: ignore[reportArgumentType]
        ),
        lights=(_light(_times(0.5, *aside), 30.0, 20.0),),
    )


# Name -> scene, description, least interior pixels.
SCENES: dict[str, tuple[Callable[[], Scene], str, int]] = {
    "slit": (slit, "Floor and ceiling 4e-9 m apart: shadow rays that start late, lights that keep a distance.", 2000),
    "crumbs": (crumbs, "Shapes of 1e-8 m: determinants, areas, edges, planes and ties in metres.", 1200),
    "lamp": (lamp, "Shades 9e-5 of the way before and behind a lamp: the ends of shadow rays.", 1400),
    "skimmed_square": (skimmed_square, "A square at less than 1e-4 rad: parallel tests.", 1500),
    "skimmed_mesh": (skimmed_mesh, "Triangles in a box at less than 1e-4 rad: parallel tests.", 1500),
    "skimmed_cube": (skimmed_cube, "A cube at less than 1e-4 rad: parallel tests.", 1500),
    "skimmed_plane": (skimmed_plane, "A plane at less than 1e-4 rad: parallel tests.", 1500),
    "hall": (hall, "The inside of a cube of 1e7 m: parallel tests in object space.", 2000),
    "on_axis": (on_axis, "A sphere and boxes seen along an axis: bounding boxes that are too small.", 600),
    "low_light": (low_light, "A light 4e-5 rad above the horizon.", 2000),
    "rim": (rim, "A sphere's outline through a telescope: the discriminant, and the centre's digits.", 1000),
    "uneven": (uneven, "Large numbers with all their digits: rounding and clamping of fields.", 250),
}


def tolerances() -> Iterator[Case]:
    """Yield a case per scene."""
    for name, (make, stresses, least_interior) in SCENES.items():
        scene = make()
        yield Case(
            name=f"tolerances/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene),
            least_interior=least_interior,
        )
