"""Rays that run exactly parallel to faces: a camera that looks straight along an axis, with an odd number of pixels.

The rays of the middle column have x_d = 0 to the last bit, those of the middle row y_d = 0. A box is missed by a
parallel ray outside its slab, however the other slabs are met; a plane, a square and a triangle by any parallel ray.
"""

from collections.abc import Iterator
from dataclasses import replace

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import compose, rotation, scaling, translation
from rayproof.cases.scene import Camera, Cube, Plane, PointLight, Scene, Shape, Square, Triangle

CAMERA = Camera(
    eye=(0.0, 0.0, 6.0),
    target=(0.0, 0.0, 0.0),
    up=(0.0, 1.0, 0.0),
    fovy=38.0,
    width=81,
    height=61,
    near=0.25,
    far=40.0,
)
LIGHT = PointLight(position=(0.4, 0.3, 5.2), flux=(500.0, 430.0, 610.0))
WALL = Square(albedo=(0.6, 0.6, 0.55), to_world=compose(translation(0.1, 0.0, -2.5), scaling(9, 8, 1)))
# Beside, above and below the axis: no ray of the middle column or row meets one of these.
CUBES: tuple[Shape, ...] = (
    Cube(albedo=(0.8, 0.4, 0.3), to_world=compose(translation(1.1, 0.0, 0.2), scaling(0.9, 1.2, 0.8))),
    Cube(albedo=(0.3, 0.7, 0.4), to_world=compose(translation(0.1, -1.0, -0.3), scaling(1.4, 0.7, 1.1))),
    Cube(albedo=(0.3, 0.4, 0.8), to_world=compose(translation(-1.3, 1.0, 0.4), scaling(0.7, 0.8, 1.3))),
)
# The floor's rays run towards it, along it and away from it; the others stand along the viewing axis.
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


@CASE_FAMILIES.register("parallel_rays")
def parallel_rays() -> Iterator[Case]:
    """Yield boxes beside the axis, then flat shapes along it, then the boxes turned by half a turn."""
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
            most_edge=0.06,
        )
