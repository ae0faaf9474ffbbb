"""What Radiance declares, and how it fails."""

import pytest

from rayproof.cases.scene import Plane, PointLight, Scene, Sphere, Square
from rayproof.cases.stages import IMAGE_STAGES, Stage
from tests.reference.mitsuba3.geometry import MIRRORED, SHEARED, WHITE, looking_down

LIGHT = PointLight(position=(1, 1, 3), flux=(10.0, 20.0, 30.0))
BALL = (Sphere(albedo=WHITE),)
LIT = IMAGE_STAGES[IMAGE_STAGES.index(Stage.VISIBILITY) :]


def refused(radiance, *, shapes=BALL, camera=None, **about):
    scene = Scene(camera=camera or looking_down(height=5), shapes=shapes, lights=(LIGHT,), **about)
    return {stage for stage in IMAGE_STAGES if radiance.unsupported(scene, stage)}


@pytest.mark.parametrize(
    ("about", "expected"),
    [
        pytest.param({}, (), id="ordinary"),
        pytest.param({"shapes": ()}, (), id="empty"),
        pytest.param({"shading": "simplified"}, LIT[1:], id="simplified-shading"),
        pytest.param({"shapes": (Sphere(albedo=(0.1, 1.5, 0.1)),)}, (), id="albedo-above-one"),
        pytest.param({"shapes": (Sphere(albedo=WHITE, to_world=SHEARED),)}, IMAGE_STAGES[1:], id="sheared-sphere"),
        pytest.param({"shapes": (Square(albedo=WHITE, to_world=MIRRORED),)}, (), id="sheared-square"),
        pytest.param({"clip": "shell", "camera": looking_down(height=5, near=4.2)}, (), id="shell"),
        pytest.param({"shapes": (Plane(albedo=WHITE),)}, (), id="plane"),
        pytest.param({"shapes": (Plane(albedo=WHITE),), "clip": "none"}, LIT, id="plane-to-its-horizon"),
        pytest.param({"shapes": (Sphere(albedo=WHITE, radius=1e-9),)}, IMAGE_STAGES[1:], id="too-small"),
        pytest.param({"shapes": (Sphere(albedo=WHITE, radius=1e200),)}, IMAGE_STAGES, id="too-large"),
    ],
)
def test_what_radiance_cannot_do_is_declared_and_nothing_else(radiance, about, expected):
    assert refused(radiance, **about) == set(expected)


def test_it_shifts_shadows_by_less_than_a_millionth_of_the_scene(radiance):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=WHITE),), lights=(LIGHT,))

    assert radiance.epsilon_in(scene, {}) == pytest.approx(5e-6)
