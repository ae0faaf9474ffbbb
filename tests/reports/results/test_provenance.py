"""Where results come from: what a folder keeps, what it never keeps, and results that are computed again."""

import json
import subprocess
from pathlib import Path

import pytest

from rayproof.cases.families import select
from rayproof.cases.scene_json import save_scene
from rayproof.reports.results import provenance
from rayproof.reports.results.provenance import caption, differences, origin
from tests.conftest import GIT
from tests.reports.commands.conftest import Rayproof

MINE = """
import drjit as dr
from factor import FACTOR

def hit(ray, sphere, interval, eps=0.0):
    f = ray.origin - sphere.center
    a, h = dr.squared_norm(ray.direction), -dr.dot(f, ray.direction)
    quarter = h * h - a * (dr.squared_norm(f) - dr.square(sphere.radius * FACTOR * (1 + eps)))
    root = dr.sqrt(dr.select(quarter >= 0, quarter, 0))
    return dr.select(quarter >= 0, interval.smallest((h - root) / a, (h + root) / a), dr.inf)
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stand in a folder with a formula, a neighbour that it imports, and a scene."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "factor.py").write_text("FACTOR = 1\n")
    save_scene(select(["primitives/sphere"])[0].scene, tmp_path / "scene.json")
    return tmp_path


def test_numbers_between_their_bounds_are_equal_within_limits_and_words_never() -> None:
    before = {
        "a": ("pass", 0.5, 0.0, 1.0),
        "b": ("fail", 3.0, 1.0, float("inf")),
        "c": ("pass", float("nan"), None, None),
    }

    assert differences(before, dict(before)) == (True, [])
    assert differences(before, before | {"a": ("pass", 0.9, 0.0, 1.0)}) == (False, [])
    assert differences(before, before | {"a": ("pass", 1.1, 0.0, 1.0)}) == (False, ["a: 0.5 -> 1.1"])
    assert differences(before, before | {"b": ("pass", 3.0, 0.0, 1.0)}) == (False, ["b: fail -> pass"])
    assert differences(before, {"a": before["a"], "c": before["c"]}) == (False, ["b: not there now"])


@pytest.mark.process
def test_the_commit_is_that_of_this_checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(provenance, "git", GIT)
    here = Path(__file__).parents[3]
    asked = subprocess.run(["git", "-C", str(here), "rev-parse", "HEAD"], capture_output=True, text=True, check=False)
    if asked.returncode:
        pytest.skip("this is no checkout of git")

    made = origin(4)

    assert made["commit"] == asked.stdout.strip()
    assert f"commit {made['commit'][:12]}" in caption(made)
    assert ", seed 4, " in caption(made)


@pytest.mark.process
def test_a_comparison_is_computed_again_from_its_folder_alone(rayproof: Rayproof, folder: Path) -> None:
    asked = ("sphere/haines", "sphere=./mine.py:hit(eps=1e-4)", "scene.json", "--repetitions", 9, "--out", "kept")
    assert rayproof("compare", *asked, "--table", "t.csv").code == 0
    for name in ("mine.py", "factor.py", "scene.json"):
        (folder / name).unlink()

    told = rayproof("report", "reproduce", "kept")
    again = rayproof("report", "reproduce", "kept", "--trust")

    assert told.code == again.code == 0, again.error
    assert "rayproof compare sphere/haines 'sphere=./mine.py:hit(eps=1e-4)' scene.json" in told.out
    kept = json.loads((folder / "kept" / "origin" / "compare" / "origin.json").read_text())
    assert set(kept["files"]) == {"0/mine.py", "0/factor.py", "1/scene.json"}
    assert all(digest in told.out for digest in [*kept["files"].values(), kept["result"]])
    assert "compare: equal, 2 results" in again.out
