"""Stills: of which cases, drawn once, in a child process that may die; without OpenGL one line says so."""

import copy
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from rayproof.reports.publish.scene3d import stills
from rayproof.reports.publish.scene3d.parts import look
from rayproof.reports.results.headline import worst_first

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
