"""Pictures are drawn in a child process; where it cannot draw or dies, one line says so and the run goes on."""

import copy
import shutil
import signal
import threading
import time

import numpy as np
import pytest
from PIL import Image

from rayproof.reports.publish.scene3d import gl, pictures
from rayproof.reports.publish.scene3d.pictures import draw_pictures
from rayproof.reports.results.headline import worst_first


@pytest.fixture
def results(published):
    """Return results that a test may change, of three cases."""
    changed = copy.deepcopy(published.results)
    changed["cases"] = changed["cases"][:3]
    return changed


@pytest.mark.process
def test_every_case_gets_a_picture_with_something_in_it(published, results):
    reason = gl.why_not()
    if reason:
        pytest.skip(reason)
    drawn = []

    why = draw_pictures(published.folder, results, drawn.append)

    assert why is None
    assert drawn == [case["name"] for case in results["cases"]]
    for case in results["cases"]:
        with Image.open(published.folder / case["picture"]) as picture:
            assert picture.size == (600, 450)
            pixels = np.asarray(picture.convert("RGB"))
        assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 100


@pytest.mark.process
def test_without_opengl_nothing_is_drawn_and_the_reason_is_given(published, results, monkeypatch):
    monkeypatch.setattr(gl, "why_not", lambda: "OpenGL is missing")

    assert draw_pictures(published.folder, results) == "OpenGL is missing"
    assert [case["picture"] for case in results["cases"]] == [None] * 3


@pytest.mark.process
def test_a_child_that_is_killed_by_opengl_is_one_clear_line(published, results, monkeypatch):
    monkeypatch.setattr(gl, "why_not", lambda: None)
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "bogus")

    why = draw_pictures(published.folder, results)

    assert why is not None
    assert "0 of 3 drawn" in why
    assert "\n" not in why


@pytest.mark.process
def test_a_scene_that_cannot_be_read_costs_only_its_own_picture(published, results, tmp_path):
    reason = gl.why_not()
    if reason:
        pytest.skip(reason)
    for case in results["cases"]:
        scene = tmp_path / case["scene"]
        scene.parent.mkdir(parents=True, exist_ok=True)
        scene.write_bytes((published.folder / case["scene"]).read_bytes())
    (tmp_path / results["cases"][1]["scene"]).write_text("{}")

    why = draw_pictures(tmp_path, results)

    assert why is not None
    assert why.startswith(f"2 of 3 drawn; {results['cases'][1]['name']}: ")
    assert [case["picture"] is not None for case in results["cases"]] == [True, False, True]


@pytest.mark.process
def test_where_cases_wait_another_child_draws_the_same(published, results, tmp_path, monkeypatch):
    folders = [tmp_path / "one", tmp_path / "several"]
    started = []
    child = pictures.DrawingChild
    monkeypatch.setattr(pictures, "DrawingChild", lambda *a, **k: started.append(1) or child(*a, **k))
    monkeypatch.setattr(pictures, "MOST", 2)
    for folder, backlog in zip(folders, (3, 1), strict=True):
        shutil.copytree(published.folder, folder)
        shutil.rmtree(folder / "pictures", ignore_errors=True)
        monkeypatch.setattr(pictures, "BACKLOG", backlog)
        assert draw_pictures(folder, results) == gl.why_not()
        started.append(0)

    assert started == [1, 0, 1, 1, 0]
    drawn = [{path.name: path.read_bytes() for path in (each / "pictures").rglob("*.*")} for each in folders]
    assert len(drawn[0]) >= 3
    assert drawn[0] == drawn[1]


@pytest.mark.process
def test_of_two_children_the_one_that_is_killed_is_named_and_the_other_draws_on(
    published, results, tmp_path, monkeypatch
):
    shutil.copytree(published.folder, tmp_path / "folder")
    monkeypatch.setattr(gl, "why_not", lambda: "no pictures here")  # views are enough
    monkeypatch.setattr(pictures, "BACKLOG", 0)
    monkeypatch.setattr(pictures, "MOST", 2)
    first, *rest = results["cases"]
    with pictures.Drawing(tmp_path / "folder") as drawing:
        drawing.submit(rest[0])
        drawing.submit(first)
        drawing._release(wait=True)
        drawing._children[1]._process.kill()
        drawing._children[1]._process.wait()
        drawing.submit(rest[1])

    drawing.tell(results["cases"])
    assert drawing.reason == "drawing ended at the first case (signal 9); 2 of 3 drawn"
    assert [case["view"] is not None for case in results["cases"]] == [False, True, True]


@pytest.mark.process
def test_a_child_that_is_stopped_costs_its_pictures_and_not_the_run(published, results, tmp_path, monkeypatch):
    shutil.copytree(published.folder, tmp_path / "folder")
    monkeypatch.setattr(gl, "why_not", lambda: "no pictures here")  # views are enough
    start = time.monotonic()
    with pictures.Drawing(tmp_path / "folder", seconds=2.0) as drawing:
        for case in results["cases"]:
            drawing.submit(case | {"stage": "x" * 2**17})  # more than a pipe holds
        drawing._release(wait=True)
        assert drawing.pending
        drawing._children[0]._process.send_signal(signal.SIGSTOP)

    assert drawing.reason == "drawing ended at the first case (nothing for 2 s; stopped); 0 of 3 drawn"
    assert time.monotonic() - start < 60


@pytest.mark.process
def test_nobody_waits_for_the_answer_whether_there_is_opengl(published, results, monkeypatch):
    answer = threading.Event()
    monkeypatch.setattr(gl, "why_not", lambda: "no pictures here" if answer.wait(60) else None)
    with pictures.Drawing(published.folder) as drawing:
        start = time.monotonic()
        drawing.submit(results["cases"][0])
        assert time.monotonic() - start < 10
        assert drawing.pending
        answer.set()

    drawing.tell(results["cases"])
    assert drawing.reason == "no pictures here"
    assert results["cases"][0]["view"] is not None


def test_of_a_long_run_the_worst_are_drawn_and_others_when_they_are_asked_for(results, monkeypatch):
    cases = results["cases"]
    monkeypatch.setattr(pictures, "ALL_OF", len(cases) - 1)
    monkeypatch.setattr(pictures, "WORST", 2)

    assert [case["name"] for case in pictures.drawn_usually(cases)] == [case["name"] for case in worst_first(cases)[:2]]
    assert [case["name"] for case in pictures.chosen(cases, "worst:1")] == [worst_first(cases)[0]["name"]]
    assert len(pictures.chosen(cases, "all")) == len(cases)
    assert [case["name"] for case in pictures.chosen(cases, cases[1]["name"])] == [cases[1]["name"]]
    with pytest.raises(LookupError, match="no case called nobody"):
        pictures.chosen(cases, "nobody")
    with pytest.raises(ValueError, match="from 1 on, got worst:0"):
        pictures.chosen(cases, "worst:0")
