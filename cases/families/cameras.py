"""Families `cameras` (angles, rolls, image sizes) and `parallel_rays` (rays exactly parallel to faces)."""

from collections.abc import Iterator
from dataclasses import replace

from rayproof.cases.case import Case, covering
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation
from rayproof.cases.scene import Camera, Cube, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle, Vector

# The two ray-generation methods and the camera's matrices over field of view, aspect, roll and direction.
TARGET: Vector = (0.3, -0.2, 0.4)
SHAPES: tuple[Shape, ...] = (
    Square(
        albedo=(0.6, 0.6, 0.5),
        to_world=compose(translation(0.2, 0.1, -0.7), rotation((0.3, 1.0, 0.1), 6), scaling(9.0, 7.0, 1.0)),
    ),
    Sphere(albedo=(0.7, 0.4, 0.3), center=(0.9, -0.6, 0.3), radius=0.8),
    Cube(albedo=(0.3, 0.5, 0.7), to_world=compose(translation(-0.6, 0.5, 0.3), rotation((0.2, -0.4, 1.0), 33))),
)

# Name, description, camera, least interior pixels.
CAMERAS: tuple[tuple[str, str, Camera, int], ...] = (
    (
        "narrow",
        "A field of view of 9 degrees from afar: the rays differ in their last digits.",
        camera_around(TARGET, distance=20, azimuth=24, elevation=35, width=80, height=64, fovy=9),
        2500,
    ),
    (
        "ordinary",
        "An ordinary field of view in a generic frame: the two camera methods against each other.",
        camera_around(TARGET, distance=5, azimuth=-63, elevation=29, width=96, height=72, fovy=47),
        2500,
    ),
    (
        "wide",
        "A field of view of 118 degrees: tan(alpha) is far from alpha.",
        camera_around(TARGET, distance=2.6, azimuth=140, elevation=50, width=96, height=72, fovy=118),
        2000,
    ),
    (
        "panorama",
        "An image more than three times as wide as high: the aspect must scale the horizontal axis.",
        camera_around(TARGET, distance=5, azimuth=75, elevation=31, width=128, height=40, fovy=32),
        1500,
    ),
    (
        "portrait",
        "An image almost three times as high as wide: the angle stays the vertical one.",
        camera_around(TARGET, distance=6, azimuth=-150, elevation=38, width=40, height=112, fovy=62),
        1200,
    ),
    (
        "banked",
        "A camera rolled by 131 degrees: up is not the world's vertical.",
        camera_around(TARGET, distance=5.5, azimuth=10, elevation=27, width=88, height=64, fovy=44, roll=131),
        2000,
    ),
    (
        "slanted_up",
        "An up vector far from a right angle with the view, and not of unit length: it only says which way is up.",
        Camera(
            eye=(3.4, -2.9, 3.1),
            target=TARGET,
            up=(0.3, -0.5, 2.2),
            fovy=51.0,
            width=84,
            height=64,
            near=0.25,
            far=40.0,
        ),
        2500,
    ),
    (
        "from_below",
        "A camera below the floor that looks up at the back of a square.",
        camera_around(TARGET, distance=6, azimuth=-20, elevation=-52, width=64, height=96, fovy=60, roll=-25),
        2500,
    ),
    (
        "along_axis",
        "A camera that looks straight down an axis, where signs and swapped axes hide in generic frames.",
        Camera(
            eye=(0.3, -0.2, 6.4), target=TARGET, up=(0.0, 1.0, 0.0), fovy=50.0, width=72, height=56, near=0.25, far=32.0
        ),
        2500,
    ),
)


def cameras() -> Iterator[Case]:
    """Yield one case per camera, over the same unlit scene.

    Wide and narrow angles, wide and tall images, banked cameras and cameras that look along an axis expose a swapped
    sine, a forgotten aspect and a mirrored row; the two methods must agree everywhere.
    """
    for name, stresses, camera, least_interior in CAMERAS:
        scene = Scene(camera=camera, shapes=SHAPES)
        yield Case(
            name=f"cameras/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene, "CAM-5"),
            least_interior=least_interior,
        )


# Rays that run exactly parallel to faces: a camera that looks straight along an axis, with an odd number of pixels.
CAMERA = Camera(
    eye=(0.0, 0.0, 6.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fovy=38.0, width=81, height=61, near=0.25, far=40.0
)
LIGHT = PointLight(position=(0.4, 0.3, 5.2), flux=(500.0, 430.0, 610.0))
WALL = Square(albedo=(0.6, 0.6, 0.55), to_world=compose(translation(0.1, 0.0, -2.5), scaling(9, 8, 1)))
# Left, right, above and below the axis: no ray of the middle column or row hits one of these.
CUBES: tuple[Shape, ...] = (
    Cube(albedo=(0.8, 0.4, 0.3), to_world=compose(translation(1.1, 0.0, 0.2), scaling(0.9, 1.2, 0.8))),
    Cube(albedo=(0.3, 0.7, 0.4), to_world=compose(translation(0.1, -1.0, -0.3), scaling(1.4, 0.7, 1.1))),
    Cube(albedo=(0.3, 0.4, 0.8), to_world=compose(translation(-1.3, 1.0, 0.4), scaling(0.7, 0.8, 1.3))),
)
# Rays run towards the floor, along it and away from it; the other shapes are parallel to the viewing axis.
FLAT: tuple[Shape, ...] = (
    Plane(albedo=(0.5, 0.6, 0.7), to_world=compose(translation(0.0, -1.3, 0.0), rotation((1.0, 0.0, 0.0), -90))),
    Square(
        albedo=(0.8, 0.5, 0.3),
        to_world=compose(translation(1.2, 0.1, 0.3), rotation((0.0, 1.0, 0.0), -90), scaling(1.6, 1.3, 1.0)),
    ),
    Triangle(albedo=(0.4, 0.7, 0.5), vertices=((-0.9, 1.0, 1.5), (0.8, 1.0, 0.9), (-0.3, 1.0, -1.6))),
)


# The same boxes, each turned by half a turn about its own z axis without a rounding: in object space a component of 0
# comes out as -0.
TURNED: tuple[Shape, ...] = tuple(
    replace(cube, to_world=compose(cube.to_world, scaling(-1.0, -1.0, 1.0))) for cube in CUBES
)


def parallel_rays() -> Iterator[Case]:
    """Yield boxes off the axis, then flat shapes along it, then the boxes turned by half a turn.

    The rays of the middle column have x_d = 0 to the last bit, those of the middle row y_d = 0. A parallel ray outside
    a slab misses the box, whether or not it crosses the other slabs; any parallel ray misses a plane, a square and a
    triangle.
    """
    flat = "A floor, a square and a triangle that the middle rays run along."
    questions = (
        ("cubes", (WALL, *CUBES), "Upright boxes beside the axis: parallel rays outside a slab.", (), 3500),
        ("flat", FLAT, flat, ("HIT-5", "HIT-8"), 1500),
        ("cubes_turned", (WALL, *TURNED), "The boxes after half a turn: a component of 0 becomes -0.", (), 3500),
    )
    for name, shapes, stresses, more, least_interior in questions:
        scene = Scene(camera=CAMERA, shapes=shapes, lights=(LIGHT,))
        yield Case(
            name=f"parallel_rays/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene, "CAM-5", *more),
            least_interior=least_interior,
        )
