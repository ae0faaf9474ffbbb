"""`rayproof vectors` writes the files and judges answers; whatever is wrong ends in one line."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.reports.commands.conftest import Rayproof
from tests.reports.vectors.answers import of_formula, written


def test_it_writes_the_files_of_the_slots_that_are_named(rayproof: Rayproof, tmp_path: Path) -> None:
    ended = rayproof("vectors", "write", "sphere", "falloff", "--out", tmp_path)

    assert ended.code == 0
    names = {path.name for path in tmp_path.iterdir() if not path.name.startswith(".")}
    assert names >= {"sphere.csv", "sphere_extreme.csv", "irradiance.csv", "vectors.json", "schema.json", "check.py"}
    assert "triangle.csv" not in names


def test_it_judges_answers_and_publishes(rayproof: Rayproof, tmp_path: Path) -> None:
    cells = of_formula("sphere/haines", "sphere", "float32")
    answers = written(tmp_path / "mine.csv", {i: row for i, row in cells.items() if "extreme" not in i})

    ended = rayproof("vectors", "judge", answers, "--out", tmp_path / "judged")

    assert ended.code == 0
    assert "SPH-FAR" in ended.out
    suites = ElementTree.parse(tmp_path / "judged" / "junit.xml").getroot()
    assert [suite.get("failures") for suite in suites] == ["0"]
    assert (tmp_path / "judged" / "vectors.md").read_text().startswith("# mine, float32\n")


def test_answers_that_are_all_skipped_measure_nothing(rayproof: Rayproof, tmp_path: Path) -> None:
    cells = {i: {"hit": "skip", "t": ""} for i in of_formula("plane/dot_products", "plane", "float32")}

    assert rayproof("vectors", "judge", written(tmp_path / "none.csv", cells)).code == 3


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("write",), "--out"),
        (("write", "corners", "--out", "x"), "frustum"),
        (("write", "juggling", "--out", "x"), "juggling"),
        (("judge", "nowhere.csv"), "nowhere.csv"),
    ],
)
def test_bad_usage_ends_in_one_line(
    rayproof: Rayproof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], named: str
) -> None:
    monkeypatch.chdir(tmp_path)

    ended = rayproof("vectors", *arguments)

    assert (ended.code, ended.out, ended.error.count("\n")) == (2, "", 1)
    assert named in ended.error
