"""What Mitsuba declares that it cannot do, and that it declares nothing else."""

import numpy as np
import pytest

from rayproof.cases.scene import Plane, PointLight, Scene, Sphere, Square
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.mitsuba3.scene import RAY_EPSILON, SHADOW_EPSILON, offsets
from tests.reference.mitsuba3.geometry import WHITE, answer, looking_down

LIGHT = PointLight(position=(1, 1, 3), flux=(10.0, 20.0, 30.0))
LIT = (Stage.VISIBILITY, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


def refused(mitsuba, *, near=0.1, far=100.0, shape=None, **about):
    shapes = (shape or Sphere(albedo=WHITE),)
    scene = Scene(camera=looking_down(height=5, near=near, far=far), shapes=shapes, lights=(LIGHT,), **about)
    return {stage for stage in IMAGE_STAGES if mitsuba.unsupported(scene, stage)}


def test_every_stage_of_an_ordinary_scene_is_answered(mitsuba):
    scene = Scene(camera=looking_down(height=5), shapes=(Sphere(albedo=WHITE),), lights=(LIGHT,))

    assert [stage for stage in Stage if mitsuba.unsupported(scene, stage)] == []
    assert set(mitsuba.render(scene, tuple(Stage))) == set(Stage)


@pytest.mark.parametrize(
    ("about", "expected"),
    [
        pytest.param({"shading": "simplified"}, LIT[1:], id="simplified-shading"),
        pytest.param({"shape": Sphere(albedo=(0.1, 1.5, 0.1))}, LIT[3:], id="albedo-above-one"),
        pytest.param({"clip": "none"}, (), id="no-clipping"),
        pytest.param({"clip": "shell"}, (), id="shell-that-clips-nothing"),
        pytest.param({"clip": "shell", "near": 4.2}, LIT[3:], id="shell-that-clips"),
        pytest.param({"clip": "shell", "shape": Plane(albedo=WHITE)}, LIT[3:], id="shell-and-plane"),
        pytest.param({"shape": Sphere(albedo=WHITE, radius=1e-3)}, LIT, id="smaller-than-the-offset"),
        pytest.param({"shape": Sphere(albedo=WHITE, center=(1e5, 0, 0))}, LIT, id="far-from-the-origin"),
        pytest.param({"shape": Sphere(albedo=WHITE, radius=1e17)}, IMAGE_STAGES, id="beyond-float32"),
    ],
)
def test_what_mitsuba_cannot_do_is_declared_and_nothing_else(mitsuba, about, expected):
    assert refused(mitsuba, **about) == set(expected)


@pytest.mark.parametrize(("gap", "seen"), [(0.5, False), (2.0, True)], ids=["within-the-offset", "beyond-the-offset"])
def test_blockers_below_the_start_of_a_shadow_ray_do_not_count(mitsuba, gap, seen):
    # A sheet hangs so low over the floor that the camera, which starts below it, sees the floor alone.
    sheet = Square(albedo=WHITE, to_world=((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, gap * RAY_EPSILON), (0, 0, 0, 1)))
    camera = looking_down(height=0.25 * RAY_EPSILON, near=1e-6, fovy=10)
    light = PointLight(position=(0, 0, 1), flux=(10.0, 20.0, 30.0))
    scene = Scene(camera=camera, shapes=(Plane(albedo=WHITE), sheet), lights=(light,))

    shape, visibility = answer(mitsuba, scene, Stage.OBJECT, Stage.VISIBILITY)

    assert not shape.any()
    assert np.all(visibility == (not seen))


@pytest.mark.parametrize(("gap", "seen"), [(0.5, False), (2.0, True)], ids=["within-the-gap", "beyond-the-gap"])
def test_blockers_closer_to_the_light_than_a_shadow_ray_reaches_do_not_count(mitsuba, gap, seen):
    light = PointLight(position=(0, 0, 1), flux=(10.0, 20.0, 30.0))
    under = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 1 - gap * SHADOW_EPSILON), (0, 0, 0, 1))
    scene = Scene(
        camera=looking_down(height=0.5, fovy=10),
        shapes=(Plane(albedo=WHITE), Square(albedo=WHITE, to_world=under)),
        lights=(light,),
    )

    (visibility,) = answer(mitsuba, scene, Stage.VISIBILITY)

    assert np.all(visibility == (not seen))


def test_the_offset_is_what_mitsuba_s_own_constants_say(mitsuba):
    import mitsuba as mi

    mi.set_variant(mitsuba.variant)

    assert mi.math.RayEpsilon == RAY_EPSILON
    assert pytest.approx(SHADOW_EPSILON, rel=2.0**-23) == mi.math.ShadowEpsilon
    assert offsets(np.array([[1.0, -3.0, 2.0]])) == pytest.approx([4 * RAY_EPSILON])


def test_epsilon_is_the_largest_offset_that_the_camera_sees(mitsuba):
    scene = Scene(camera=looking_down(height=5), shapes=(Sphere(albedo=WHITE, center=(0, 0, 1)),))

    per_pixel = mitsuba.epsilon_per_pixel(scene)

    assert mitsuba.epsilon(scene) == pytest.approx(3 * RAY_EPSILON, rel=1e-6)
    assert per_pixel[0, 0] == 0
    assert per_pixel.shape == (scene.camera.height, scene.camera.width)
