"""`rayproof vectors` writes the files and judges answers; whatever is wrong ends in one line."""

from pathlib import Path
from xml.etree import ElementTree

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
