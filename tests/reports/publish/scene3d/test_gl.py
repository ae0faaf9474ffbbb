"""The probe for OpenGL: asked in a child, a yes remembered until something changes, a no never."""

import json

import pytest

from rayproof.reports.publish.scene3d import gl


def test_a_yes_is_remembered_until_the_environment_changes(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(gl, "probe", lambda: asked.append(1))

    answers = [gl.why_not(tmp_path), gl.why_not(tmp_path)]
    monkeypatch.setenv("DISPLAY", ":17")
    answers.append(gl.why_not(tmp_path))

    assert answers == [None] * 3
    assert len(asked) == 2


def test_a_no_is_not_remembered(tmp_path, monkeypatch):
    monkeypatch.setattr(gl, "probe", lambda: "too little memory")
    assert gl.why_not(tmp_path) == "too little memory"

    monkeypatch.setattr(gl, "probe", lambda: None)
    assert gl.why_not(tmp_path) is None


def test_a_damaged_memory_is_asked_again(tmp_path, monkeypatch):
    monkeypatch.setattr(gl, "probe", lambda: None)
    gl.why_not(tmp_path)
    (memory,) = tmp_path.iterdir()
    memory.write_text("{")

    assert gl.why_not(tmp_path) is None
    assert json.loads(memory.read_text()) == {"draws": True}


def test_a_cache_that_cannot_be_written_does_no_harm(tmp_path, monkeypatch):
    monkeypatch.setattr(gl, "probe", lambda: None)
    (tmp_path / "file").write_text("")

    assert gl.why_not(tmp_path / "file") is None


@pytest.mark.process
def test_a_window_class_that_does_not_exist_is_a_reason_and_no_crash(monkeypatch):
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "bogus")

    reason = gl.probe()

    assert reason is not None
    assert "\n" not in reason
    assert "OpenGL is missing" in reason or "cannot draw" in reason


def test_the_users_window_class_wins(monkeypatch):
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkOSOpenGLRenderWindow")
    assert gl.drawing_environment()["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkOSOpenGLRenderWindow"

    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW")
    monkeypatch.setattr("sys.platform", "linux")
    assert gl.drawing_environment()["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkEGLRenderWindow"


@pytest.mark.parametrize("path", ["scenes/a/b_0.5.json"])
def test_a_picture_is_named_as_the_run_named_the_scene(path):
    from rayproof.reports.publish.scene3d.pictures import picture_path

    assert picture_path({"scene": path}) == "pictures/a/b_0.5.png"
    assert picture_path({"scene": "scenes/../../x.json"}) is None
    assert picture_path({"scene": None}) is None
