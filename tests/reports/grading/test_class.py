"""A small class, graded by the command: points, what is handed out, and what strangers' programs cannot do to it."""

import base64
import csv
import json
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from rayproof.reports.grading.classes import Graded, Roundings, equal_pairs
from rayproof.reports.grading.pages import HIDDEN, UNCONFINED, Book, safe
from rayproof.reports.grading.points import ItemGrade, State
from rayproof.reports.grading.rubric import Rubric, RubricFile, load_rubric
from rayproof.reports.grading.submission import Place, SubmissionError, digest, readable
from rayproof.reports.subjects import reason_unconfined
from tests.harness.grading.campaign import PYTHON_SOURCE
from tests.reports.commands.conftest import Rayproof, rayproof

__all__ = ["rayproof"]
RUBRIC = """
title = "A <course>"
points = {HIT-1 = 3, HIT-3 = 2, RAD-4 = 1}
[program]
run = "/usr/bin/python3 renderer.py {scene} {output}"
own = true
[cases]
visible = ["combined/26*", "primitives/sphere"]
hidden = ["combined/30*"]
seed = 7
"""
THIEF = """
import os, sys
for path in ({neighbour!r}, {rubric!r}, {answers!r}):
    try:
        print(open(path).read())
    except OSError:
        pass
try:
    open({mark!r}, "w").write("here")
except OSError:
    pass
for name in ("results.json", "grade.json", "../grade.json", "/tmp/call/results.json"):
    try:
        open(name, "w").write('{{"points": 100}}')
    except OSError:
        pass
"""


@pytest.fixture
def rubric(tmp_path: Path) -> Rubric:
    (tmp_path / "rubric.toml").write_text(RUBRIC)
    return load_rubric(tmp_path / "rubric.toml")


@pytest.mark.process
@pytest.mark.references
@pytest.mark.skipif(not Path("/usr/bin/python3").exists(), reason="there is no /usr/bin/python3")
def test_a_class_is_graded_and_a_thief_gains_nothing(rubric: Rubric, tmp_path: Path, rayproof: Rayproof) -> None:
    if (why := reason_unconfined()) is not None:
        pytest.skip(why)
    made = tmp_path / "submissions"
    for name, words in (("right", ""), ("=wrong", "--mistake cube_doubled,no_pi ")):
        (made / name).mkdir(parents=True)
        (made / name / "renderer.py").write_text(PYTHON_SOURCE.read_text())
        run = f"/usr/bin/python3 renderer.py {words}{{scene}} {{output}}"
        (made / name / "rayproof.toml").write_text(f'run = "{run}"\n')
    (made / "thief").mkdir()
    mark, answers = tmp_path / "mark", tmp_path / "grades" / "teacher" / "grades.json"
    stolen = {"neighbour": made / "right" / "renderer.py", "rubric": rubric.path, "answers": answers, "mark": mark}
    (made / "thief" / "renderer.py").write_text(THIEF.format(**{name: str(path) for name, path in stolen.items()}))
    (made / "linked").mkdir()
    (made / "linked" / "renderer.py").symlink_to(made / "right" / "renderer.py")

    ended = rayproof("grade", made, "--rubric", rubric.path, "--out", tmp_path / "grades")

    assert ended.code == 0, ended.error
    rows = {
        row["name"]: row for row in csv.DictReader((tmp_path / "grades/teacher/gradebook.csv").read_text().splitlines())
    }
    assert {name: float(row["points"]) for name, row in rows.items()} == {
        "right": 6, "'=wrong": 3, "thief": 0, "linked": 0,
    }  # fmt: skip
    assert "is a link" in rows["linked"]["problem"]
    assert not mark.exists()
    students = tmp_path / "grades" / "students"
    everything = "".join(path.read_text() for path in students.rglob("*") if path.is_file())
    assert not any(name in everything for name in rubric.hidden)
    assert "def render(" not in everything
    assert "<course>" not in everything
    wrong = json.loads((students / "=wrong" / "results.json").read_text())
    assert [test["score"] for test in wrong["tests"]] == [3, 0, 0]
    assert wrong["stdout_visibility"] == "hidden"
    told = json.loads(base64.b64decode((students / "=wrong" / "classroom.txt").read_text()))
    assert (told["max_score"], sum(test["score"] for test in told["tests"])) == (6, 3)
    page = (students / "=wrong" / "index.html").read_text()
    assert "leaves out 1/pi" in page
    assert page.count("data:image/png;base64") >= 1
    assert HIDDEN in page  # of the cube, whose only case is hidden
    facts = json.loads(answers.read_text())
    assert (facts["seed"], facts["rubric"]) == (7, rubric.digest)

    again = rayproof("grade", made, "--rubric", rubric.path, "--out", tmp_path / "grades")
    assert again.code == 0
    assert json.loads(answers.read_text()) == facts


def graded(name: str, *grades: ItemGrade, **more: Roundings) -> Graded:
    return Graded(
        name=name, digest="d", rubric="r", rayproof="0", confined=False, problem="", grades=list(grades), roundings=more
    )


def test_pages_say_that_nothing_was_confined_and_what_is_hidden_stays_so(rubric: Rubric, tmp_path: Path) -> None:
    place = Place(submissions=tmp_path / "s", out=tmp_path / "out", confined=False)
    secret = next(iter(rubric.hidden))
    lost = ItemGrade(item="HIT-3", of=2, state=State.ERROR, sentence="it printed the scene", cases=(secret,))
    student = graded("<b>ada", lost, ItemGrade(item="RAD-4", of=1, state=State.EARNED))
    place.teacher.mkdir(parents=True)
    Book(rubric=rubric, place=place, graded=[student]).write()
    for path in (place.out / "students" / "<b>ada").iterdir():
        text = path.read_text()
        text = base64.b64decode(text).decode() if path.suffix == ".txt" else text
        assert secret not in text
        assert "printed the scene" not in text
        assert "<b>" not in text or path.suffix != ".html"
    for path in (place.out / "students" / "<b>ada" / "index.html", place.teacher / "class.html"):
        assert UNCONFINED in path.read_text()


def test_equal_roundings_are_a_hint_where_there_are_enough() -> None:
    ada, bob = (graded(name, a=Roundings(900, "x"), b=Roundings(200, "y")) for name in ("ada", "bob"))
    eve = graded("eve", a=Roundings(900, "x"), b=Roundings(200, "other"))
    few = [graded(name, a=Roundings(900, "x")) for name in ("fay", "gil")]
    assert equal_pairs([ada, bob, eve, *few]) == [("ada", "bob", 1100), ("ada", "fay", 900), ("ada", "gil", 900)][:1]


@pytest.mark.parametrize("cell", ["=1+1", "+1", "-1", "@x", "\tx"])
def test_no_cell_is_a_formula(cell: str) -> None:
    assert safe(cell) == f"'{cell}"
    assert (safe("name"), safe(-1.5)) == ("name", -1.5)


def test_special_files_are_refused(tmp_path: Path) -> None:
    import os

    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(SubmissionError, match="special file"):
        digest(tmp_path)


def test_a_readable_folder_holds_no_answers(rubric: Rubric, tmp_path: Path) -> None:
    place = Place(submissions=tmp_path / "course" / "s", out=tmp_path / "course" / "out", confined=True)
    place.submissions.mkdir(parents=True)

    def asked(folder: Path) -> Rubric:
        table = replace_readable(rubric, folder)
        return replace(rubric, file=table)

    with pytest.raises(ValueError, match="no submission may read"):
        readable(asked(place.submissions), place)
    with pytest.raises(ValueError, match="move it elsewhere"):
        readable(asked(tmp_path), place)
    place.out.mkdir()
    _, masked = readable(asked(tmp_path / "course"), place)
    assert {str(place.submissions), str(place.out)} <= {*masked}


def replace_readable(rubric: Rubric, folder: Path) -> RubricFile:
    return msgspec.structs.replace(
        rubric.file, readable=msgspec.structs.replace(rubric.file.readable, folders=[str(folder)])
    )


def test_usage_errors_end_in_one_line(tmp_path: Path, rayproof: Rayproof) -> None:
    written = rayproof("new", "rubric", tmp_path / "rubric.toml")
    assert written.code == 0
    assert rayproof("new", "rubric", tmp_path / "rubric.toml").code == 2
    (tmp_path / "none").mkdir()
    ended = rayproof("grade", tmp_path / "none", "--rubric", tmp_path / "rubric.toml", "--out", tmp_path / "out")
    assert (ended.code, ended.error.count("\n")) == (2, 1)
    assert "no sub-folder" in ended.error
