"""What Radiance declares, and how it fails."""

import importlib.util
from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.scene import Plane, PointLight, Scene, Sphere, Square, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference import REFERENCES
from rayproof.reference.radiance import Radiance, program
from tests.reference.mitsuba3.geometry import MIRRORED, SHEARED, WHITE, answer, looking_down

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


def test_it_has_no_camera(radiance):
    scene = Scene(camera=looking_down(height=5), shapes=())

    assert "no camera" in radiance.unsupported(scene, Stage.CAMERA)


def test_only_light_is_coarse(radiance):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=WHITE),), lights=(LIGHT,))

    coarse = {stage: radiance.resolution(scene, stage) for stage in IMAGE_STAGES}

    assert {stage for stage, one in coarse.items() if one} == {Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE}
    assert all(0 < one.relative < 1e-6 for one in coarse.values() if one)


def test_it_says_what_stands_in_for_planes_and_lights_and_by_which_settings(radiance):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=WHITE),), lights=(LIGHT,))

    assert [note.split()[0] for note in radiance.notes(scene)] == ["Infinite", "Every"]
    assert "-dt 0" in radiance.settings(scene)["rtrace"]
    assert radiance.settings(scene) != radiance.settings(replace(scene, camera=looking_down(height=50)))


def test_it_shifts_shadows_by_less_than_a_millionth_of_the_scene(radiance):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=WHITE),), lights=(LIGHT,))

    assert radiance.epsilon_in(scene, {}) == pytest.approx(5e-6)


def test_it_is_an_independent_witness_that_is_always_asked(radiance):
    about = REFERENCES.about("radiance")

    assert about["independent"]
    assert not about.get("on_request", False)
    assert radiance.version().startswith("Radiance rtrace 6.0a (pyradiance 1.3.1")


def test_it_says_how_to_install_what_is_missing(monkeypatch):
    monkeypatch.setattr(program, "find_spec", lambda name: None)
    monkeypatch.setattr(program, "folder", program.folder.__wrapped__)  # nothing was found before

    assert "pip install pyradiance" in str(Radiance.missing())
    assert importlib.util.find_spec is not program.find_spec


def test_programs_that_are_not_there_are_named(monkeypatch, leftovers):
    monkeypatch.setattr(program, "folder", lambda: leftovers)

    said = str(Radiance.missing())

    assert "oconv" in said
    assert "rtrace" in said


@pytest.mark.parametrize("failing", ["oconv", "rtrace"])
def test_a_program_that_fails_is_an_error_that_names_it(radiance, monkeypatch, failing):
    right = program._run

    def wrong(name, *arguments, **about):
        return right(name, *(("-nonsense",) if name == failing else arguments), **about)

    monkeypatch.setattr(program, "_run", wrong)
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=WHITE),), lights=(LIGHT,))

    with pytest.raises(RuntimeError, match=f"{failing} ended with"):
        radiance.render(scene, (Stage.OBJECT,))


@pytest.mark.parametrize("stage", [Stage.OBJECT, Stage.RADIANCE])
def test_half_an_answer_is_none(radiance, monkeypatch, stage):
    right = program._run

    def wrong(name, *arguments, **about):
        answered = right(name, *arguments, **about)
        return answered[: len(answered) // 2] if name == "rtrace" else answered

    monkeypatch.setattr(program, "_run", wrong)
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=WHITE),), lights=(LIGHT,))

    with pytest.raises(RuntimeError, match="rtrace"):
        radiance.render(scene, (stage,))


def test_a_user_s_own_settings_take_no_part(radiance, monkeypatch, tmp_path_factory):
    scene = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=WHITE),), lights=(LIGHT,))
    (before,) = answer(radiance, scene, Stage.RADIANCE)
    elsewhere = str(tmp_path_factory.mktemp("elsewhere"))
    for name in ("RAYPATH", "PATH", "HOME"):
        monkeypatch.setenv(name, elsewhere)

    (after,) = answer(radiance, scene, Stage.RADIANCE)

    assert np.array_equal(before, after)


def test_degenerate_shapes_alone_are_an_empty_scene(radiance):
    flat = Triangle(albedo=WHITE, vertices=((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (2.0, 2.0, 2.0)))
    scene = Scene(camera=looking_down(height=5), shapes=(flat,), lights=(LIGHT,))

    shape, leaving = answer(radiance, scene, Stage.OBJECT, Stage.RADIANCE)

    assert np.all(shape == -1)
    assert not leaving.any()
