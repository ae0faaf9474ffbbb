"""What POV-Ray refuses, what it says of itself, and what it leaves behind: nothing."""

import tempfile
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rayproof.cases.scene import Plane, Scene, Sphere
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference import REFERENCES
from rayproof.reference.povray import program
from rayproof.reference.povray.program import FARTHEST, LIT_SCALE
from tests.reference.pictured import ALBEDO, FIRST, answer, every_shape, looking_down


def test_without_the_program_it_says_how_to_install_it(monkeypatch):
    monkeypatch.setenv("PATH", "")
    reference: Any = REFERENCES["povray"]

    assert "apt-get install" in reference.missing()
    assert reference().unsupported(every_shape(), Stage.OBJECT) == reference.missing()
    assert REFERENCES.about("povray") == {"independent": True, "optional": True, "sleeps": True}


def test_it_answers_every_image_stage_and_has_no_clip_space(povray):
    scene = every_shape()

    assert all(povray.unsupported(scene, stage) is None for stage in IMAGE_STAGES)
    assert "clip space" in povray.unsupported(scene, Stage.CAMERA)


def test_version_and_settings_say_what_was_run(povray):
    assert povray.version().startswith("POV-Ray 3.")
    assert povray.settings(every_shape())["Dither"] == "off"


def test_it_refuses_what_its_tolerances_and_its_horizon_would_spoil(povray):
    tiny = Scene(camera=looking_down(height=5), shapes=(Sphere(albedo=ALBEDO, radius=1e-5),), lights=(FIRST,))
    edge = FARTHEST / LIT_SCALE
    far = replace(tiny, shapes=(Sphere(albedo=ALBEDO, center=(edge, 0, 0)),))
    endless = replace(tiny, shapes=(Plane(albedo=ALBEDO),), clip="none")
    level = replace(looking_down(height=5), target=(1.0, 0.0, 5.0), up=(0.0, 0.0, 1.0), height=20000, width=1)

    assert "tolerance" in povray.unsupported(tiny, Stage.OBJECT)
    assert "far" in povray.unsupported(far, Stage.OBJECT)
    assert povray.unsupported(far, Stage.RAY) is None
    assert povray.unsupported(endless, Stage.OBJECT) is None
    assert "far" in povray.unsupported(replace(endless, camera=level), Stage.OBJECT)
    assert povray.unsupported(replace(endless, camera=level, clip="depth"), Stage.OBJECT) is None


def test_nothing_is_left_behind(povray, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("HOME", str(tmp_path))

    answer(povray, every_shape(), Stage.RADIANCE)

    assert list(tmp_path.iterdir()) == []


def test_a_failure_is_reported_with_what_the_program_said(povray, tmp_path, monkeypatch):
    program = tmp_path / "povray"
    program.write_text("#!/bin/sh\necho Cannot open the gates >&2\nexit 3\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/bin:/usr/bin")

    with pytest.raises(RuntimeError, match=r"ended with 3: Cannot open the gates"):
        povray.render(every_shape(), [Stage.OBJECT])


def test_of_several_exposures_the_longest_that_does_not_saturate_counts():
    short, long = np.array([[[100.0, 20000.0, 0.0]]]), np.array([[[400.0, 65535.0, 1.0]]])

    merged = program.merge([short, long], [1.0, 4.0])

    assert merged[0, 0].tolist() == [400 / 65535 / 4, 20000 / 65535, 1 / 65535 / 4]
