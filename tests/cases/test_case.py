"""What a scene covers follows from what is in it, and nothing more."""

import pytest

from rayproof.cases.case import covering
from rayproof.cases.placement import camera_around, translation
from rayproof.cases.scene import Cube, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle

CAMERA = camera_around((0, 0, 0), distance=4, azimuth=10, elevation=20, width=8, height=6)
ALWAYS = ("CAM-1", "CAM-2", "CAM-3", "CAM-4")
LIGHT = PointLight(position=(0, 0, 3), flux=(1, 1, 1))
WHITE = (1.0, 1.0, 1.0)
TRIANGLE = Triangle(albedo=WHITE, vertices=((0, 0, 0), (1, 0, 0), (0, 1, 0)), to_world=translation(1, 0, 0))


@pytest.mark.parametrize(
    ("shapes", "lights", "items"),
    [
        pytest.param((Sphere(albedo=WHITE),), (), ("HIT-1", "NRM-1"), id="sphere"),
        pytest.param((TRIANGLE,), (), ("HIT-6",), id="baked-triangle-has-no-transform"),
        pytest.param(
            (Cube(albedo=WHITE, to_world=translation(1, 0, 0)),),
            (),
            ("XF-1", "XF-2", "HIT-3", "NRM-2", "NRM-3"),
            id="moved-cube",
        ),
        pytest.param(
            (Plane(albedo=WHITE, two_sided=True),), (LIGHT,), ("HIT-4", "RAD-1", "RAD-2", "RAD-4"), id="no-blocker"
        ),
        pytest.param(
            (Square(albedo=WHITE), Sphere(albedo=WHITE)),
            (LIGHT,),
            ("HIT-1", "HIT-7", "HIT-9", "NRM-1", "LIT-1", "LIT-5", "RAD-1", "RAD-2", "RAD-4"),
            id="two-shapes-and-a-light",
        ),
    ],
)
def test_what_the_default_formulas_exercise(shapes: tuple[Shape, ...], lights, items):
    scene = Scene(camera=CAMERA, shapes=shapes, lights=lights)

    assert covering(scene) == (*ALWAYS, *items)


def test_alternatives_are_added_in_the_specifications_order():
    scene = Scene(camera=CAMERA, shapes=(Square(albedo=WHITE),), lights=(LIGHT,), shading="simplified")

    assert covering(scene, "HIT-8", "CAM-5") == (*ALWAYS, "CAM-5", "HIT-7", "HIT-8", "RAD-3")
