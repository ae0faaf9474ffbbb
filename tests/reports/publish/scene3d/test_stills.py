"""Stills: of which cases, drawn once, in a child process that may die; without OpenGL one line says so."""

import copy
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from rayproof.reports.api.outcome import Run, view3d
from rayproof.reports.publish.scene3d import stills
from rayproof.reports.publish.scene3d.parts import look
from rayproof.reports.results.headline import worst_first
from tests.reports.publish.sample import make_folder

needs_opengl = pytest.mark.skipif("stills.why_not() is not None", reason="there is no OpenGL")


@pytest.fixture
def results(published: Any) -> Any:
    """Return results that a test may change, of three cases."""
    changed = copy.deepcopy(published.results)
    changed["cases"] = changed["cases"][:3]
    return changed


@pytest.fixture
def folder(published: Any, tmp_path: Path) -> Path:
    """Return a folder that a test may change, without stills."""
    shutil.copytree(published.folder, tmp_path / "folder", ignore=shutil.ignore_patterns("pictures"))
    return tmp_path / "folder"


def cases_of(*verdicts: str) -> Any:
    """Return cases of these verdicts."""
    return [{"name": f"{number:03}", "verdict": verdict} for number, verdict in enumerate(verdicts)]


def test_failing_cases_and_the_worst_twelve_are_drawn_and_no_other_that_passed() -> None:
    few_fail = cases_of(*["pass"] * 40, *["fail"] * 3, "reference_suspect")
    many_fail = cases_of(*["pass"] * 40, *["fail"] * 30)
    most_fail = cases_of(*["pass"] * 40, *["fail"] * 300)

    drawn = stills.drawn_usually(few_fail)
    assert len(drawn) == stills.WORST
    assert sum(case["verdict"] == "pass" for case in drawn) == stills.WORST - 4
    assert drawn == worst_first(few_fail)[: stills.WORST]
    assert [case["verdict"] for case in stills.drawn_usually(many_fail)] == ["fail"] * 30
    assert len(stills.drawn_usually(most_fail)) == stills.MOST


def test_others_are_drawn_when_they_are_asked_for(results: Any) -> None:
    cases = results["cases"]

    assert [case["name"] for case in stills.chosen(cases, "worst:1")] == [worst_first(cases)[0]["name"]]
    assert len(stills.chosen(cases, "all")) == len(cases)
    assert [case["name"] for case in stills.chosen(cases, cases[1]["name"])] == [cases[1]["name"]]
    with pytest.raises(LookupError, match="no case called nobody"):
        stills.chosen(cases, "nobody")
    with pytest.raises(ValueError, match="from 1 on, got worst:0"):
        stills.chosen(cases, "worst:0")


@pytest.mark.parametrize("path", ["scenes/a/b_0.5.json"])
def test_a_still_is_named_as_the_run_named_the_scene(path: str) -> None:
    assert stills.picture_path({"scene": path}) == "pictures/a/b_0.5.png"  # type: ignore[typeddict-item]
    assert stills.picture_path({"scene": "scenes/../../x.json"}) is None  # type: ignore[typeddict-item]
    assert stills.picture_path({"scene": None}) is None  # type: ignore[typeddict-item]


@pytest.mark.process
@needs_opengl
def test_what_is_asked_for_is_drawn_once_and_again_when_an_image_changes(folder: Path, results: Any) -> None:
    cases = results["cases"]
    assert stills.draw_stills(folder, cases, cases[:2]) == (2, None)
    paths = [folder / case["picture"] for case in cases[:2]]
    assert cases[2].get("picture") is None
    for path in paths:
        with Image.open(path) as picture:
            assert picture.size == look().still
            pixels = np.asarray(picture.convert("RGB"))
        assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 100
    before = [path.stat().st_mtime_ns for path in paths]
    (folder / cases[1]["scene"]).write_text((folder / cases[1]["scene"]).read_text().replace("0.8, 0.3", "0.3, 0.8"))

    assert stills.draw_stills(folder, cases, cases[:2]) == (2, None)

    assert [path.stat().st_mtime_ns == old for path, old in zip(paths, before, strict=True)] == [True, False]
    cases[0]["picture"] = None
    stills.remove_stale(folder, cases)
    assert [path.exists() for path in paths] == [False, True]


@pytest.mark.process
def test_without_opengl_nothing_is_drawn_and_one_line_says_why(
    folder: Path, results: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "bogus")

    count, why = stills.draw_stills(folder, results["cases"], results["cases"])

    assert count == 0
    assert why is not None
    assert "\n" not in why
    assert "OpenGL is missing" in why or "cannot draw" in why
    assert [case.get("picture") for case in results["cases"]] == [None] * 3


@pytest.mark.process
@needs_opengl
def test_a_scene_that_cannot_be_read_costs_only_its_own_still(folder: Path, results: Any) -> None:
    (folder / results["cases"][1]["scene"]).write_text("{}")

    count, why = stills.draw_stills(folder, results["cases"], results["cases"])

    assert count == 2
    assert why is not None
    assert why.startswith(f"2 of 3 drawn; {results['cases'][1]['name']}: ")
    assert [case.get("picture") is not None for case in results["cases"]] == [True, False, True]


@pytest.mark.process
def test_a_child_that_says_nothing_is_stopped(folder: Path, results: Any) -> None:
    count, why = stills.draw_stills(folder, results["cases"], results["cases"], seconds=0.05)

    assert count == 0
    assert why == "0 of 3 drawn; drawing was stopped, since nothing was drawn for 0.05 s"


@pytest.mark.process
def test_a_notebook_shows_the_scene_of_the_still(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results = make_folder(tmp_path)
    result = Run(folder=tmp_path, record=results, code=1)
    with pytest.raises(LookupError, match="no case 'nobody'"):
        view3d(result, "nobody")
    if (why := stills.why_not()) is None:
        stills.draw_stills(tmp_path, results["cases"], results["cases"][:1])
        with pytest.warns(UserWarning, match="static image"):
            shown = np.asarray(view3d(result, results["cases"][0]["name"])).astype(int)
        still = np.asarray(Image.open(tmp_path / results["cases"][0]["picture"]).convert("RGB")).astype(int)
        assert (np.abs(shown - still).max(axis=-1) < 16).mean() > 0.99
    monkeypatch.setattr("rayproof.reports.publish.scene3d.plotting.why_not", lambda: why or "OpenGL is missing")
    with pytest.raises(RuntimeError, match=r"OpenGL is missing|cannot draw"):
        view3d(result, results["cases"][0]["name"])
