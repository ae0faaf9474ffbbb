"""What Tachyon refuses, what it says of itself, and what it leaves behind: nothing."""

import tempfile
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Plane, Scene, Sphere, Square
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference import REFERENCES
from rayproof.reference.tachyon import ANSWERED, program
from tests.reference.pictured import ALBEDO, FIRST, answer, every_shape, looking_down, placed, raised, tetrahedron

PLAIN = Scene(camera=looking_down(height=5), shapes=(Plane(albedo=ALBEDO),), lights=(FIRST,))
TILTED = ((1, 0, 0, 0), (0, 0.6, -0.8, 0), (0, 0.8, 0.6, 0), (0, 0, 0, 1.0))


@pytest.fixture
def absent(monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(program, "find_spec", lambda name: None)


@pytest.mark.usefixtures("absent")
def test_without_the_program_it_says_how_to_install_it():
    reference: Any = REFERENCES["tachyon"]

    assert "pip install --no-deps passagemath-tachyon" in reference.missing()
    assert reference().unsupported(PLAIN, Stage.OBJECT) == reference.missing()
    assert REFERENCES.about("tachyon") == {"independent": True, "optional": True}


def test_it_shows_pictures_only(tachyon):
    supported = [stage for stage in IMAGE_STAGES if tachyon.unsupported(PLAIN, stage) is None]

    assert supported == list(ANSWERED)
    assert "pictures" in tachyon.unsupported(PLAIN, Stage.CAMERA)


def test_version_and_settings_say_what_was_run(tachyon):
    assert tachyon.version().startswith("Tachyon 0.")
    assert "PPM48" in tachyon.settings(PLAIN)["options"]


def test_ellipsoids_are_refused_and_turned_spheres_are_not(tachyon):
    turned = Sphere(albedo=ALBEDO, to_world=TILTED)
    mirrored = Sphere(albedo=ALBEDO, to_world=placed(((-2, 0, 0), (0, 2, 0), (0, 0, 2)), 0, 0, 0))
    squeezed = Sphere(albedo=ALBEDO, to_world=placed(((1, 0, 0), (0, 1, 0), (0, 0, 0.9)), 0, 0, 0))

    for shape in (turned, mirrored):
        assert tachyon.unsupported(replace(PLAIN, shapes=(shape,)), Stage.OBJECT) is None
    assert "ellipsoids" in tachyon.unsupported(replace(PLAIN, shapes=(squeezed,)), Stage.OBJECT)
    assert "ellipsoids" in tachyon.unsupported(every_shape(), Stage.OBJECT)


@pytest.mark.parametrize("clip", ["depth", "shell"])
@pytest.mark.parametrize(
    ("shape", "cut"),
    [
        (Plane(albedo=ALBEDO), False),
        (Plane(albedo=ALBEDO, to_world=raised(3.5)), True),
        (Plane(albedo=ALBEDO, to_world=TILTED), True),
        (Plane(albedo=ALBEDO, to_world=raised(6)), False),
        (Sphere(albedo=ALBEDO), False),
        (Sphere(albedo=ALBEDO, radius=1.5), False),
        (Sphere(albedo=ALBEDO, radius=3.5), True),
        (Sphere(albedo=ALBEDO, radius=0.5, to_world=raised(9)), False),
        (Sphere(albedo=ALBEDO, center=(0.0, 1.0, 5.0), radius=2.1), True),
        (Sphere(albedo=ALBEDO, center=(0.0, 0.2, 4.9), radius=3.0), False),
        (Square(albedo=ALBEDO, to_world=raised(3.5)), True),
        (Square(albedo=ALBEDO, to_world=raised(3.5, x=4.0)), False),
        (Cube(albedo=ALBEDO, to_world=raised(3.2)), True),
        (tetrahedron(to_world=raised(2)), False),
    ],
    ids=lambda value: getattr(type(value), "__name__", value) if not isinstance(value, bool) else str(value),
)
def test_what_clipping_may_cut_is_refused(tachyon, clip, shape, cut):
    camera = looking_down(height=5, near=2, far=8)
    scene = Scene(camera=camera, shapes=(shape,), lights=(FIRST,), clip=clip)

    assert bool(tachyon.unsupported(scene, Stage.OBJECT)) == cut
    assert tachyon.unsupported(replace(scene, clip="none"), Stage.OBJECT) is None


@pytest.mark.parametrize(
    ("shape", "shown"),
    [
        (Plane(albedo=ALBEDO), False),
        (Plane(albedo=ALBEDO, to_world=raised(6)), True),
        (Plane(albedo=ALBEDO, to_world=raised(6), two_sided=True), False),
        (Sphere(albedo=ALBEDO), False),
        (Sphere(albedo=ALBEDO, radius=6), True),
        (Cube(albedo=ALBEDO), False),
        (Cube(albedo=ALBEDO, to_world=placed(((-9, 0, 0), (0, 9, 0), (0, 0, 11)), 0, 0, 0)), True),
        (tetrahedron(), False),
        (tetrahedron(to_world=placed(((-1, 0, 0), (0, 1, 0), (0, 0, 1)), 0, 0, 0)), False),
        (replace(tetrahedron(), faces=np.array([(0, 2, 1), (0, 3, 2), (0, 1, 3), (1, 2, 3)])), False),
        (replace(tetrahedron(), faces=np.array([(0, 2, 1), (0, 3, 2)])), True),
    ],
)
def test_the_light_on_the_back_of_what_is_one_sided_is_refused(tachyon, shape, shown):
    scene = replace(PLAIN, shapes=(shape,), clip="none")

    assert bool(tachyon.unsupported(scene, Stage.IRRADIANCE)) == shown
    assert tachyon.unsupported(scene, Stage.RADIANCE) is None


def test_triangles_that_it_would_miss_are_refused(tachyon):
    small = replace(PLAIN, shapes=(tetrahedron(to_world=placed(np.eye(3) * 1e-4, 0, 0, 0)),))
    vast = replace(PLAIN, shapes=(Square(albedo=ALBEDO, to_world=raised(0, 1e5)),))

    assert "miss triangles" in tachyon.unsupported(small, Stage.OBJECT)
    assert "rounding" in tachyon.unsupported(vast, Stage.OBJECT)


def test_nothing_is_left_behind(tachyon, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    answer(tachyon, PLAIN, Stage.RADIANCE)

    assert list(tmp_path.iterdir()) == []


@pytest.mark.process
def test_a_failure_is_reported_with_what_the_program_said(tmp_path, monkeypatch):
    fake = tmp_path / "tachyon"
    fake.write_text("#!/bin/sh\necho too fast\nexit 3\n")
    fake.chmod(0o755)
    monkeypatch.setattr(program, "executable", lambda: str(fake))

    with pytest.raises(RuntimeError, match=r"ended with 3: too fast"):
        REFERENCES["tachyon"]().render(PLAIN, [Stage.OBJECT])
