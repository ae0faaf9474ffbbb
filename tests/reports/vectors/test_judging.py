"""Answers judged: exact ones pass, wrong ones fail, planted faults are seen, ladders break where stability says."""

import sys
from pathlib import Path
from subprocess import run

import pytest

from rayproof.reports.vectors import SLOTS_OF
from rayproof.reports.vectors.answering import configured, formulas_of
from rayproof.reports.vectors.check import AnswerFile, WrongFileError, judged, read_answers, scored
from rayproof.reports.vectors.files import as_read, write
from rayproof.reports.vectors.judging import judge
from rayproof.reports.vectors.rows import LADDERS, everything
from rayproof.tracer.formulas import FORMULAS
from tests.reports.vectors.answers import exact, of_formula, written

PRECISIONS = ("float32", "float64")
# A fault that violates no vector, and why.
UNSEEN = {
    "corners/fault_far_by_near": "a frustum's corners are no question about a ray",
    "pixel/fault_upwards": "back from the image to its pixel is no question about a ray",
    "cube_normal/fault_other_tie": "it differs on the cube's own edges alone, where either face is right",
}
FILE_OF = {slot: file for file, slots in SLOTS_OF.items() for slot in slots}


def failed(name: str, file: str, precision: str) -> set[str]:
    rows, relations = as_read([file])
    verdicts = scored(rows, relations, AnswerFile(rows=of_formula(name, file, precision)), precision)
    return {verdict.id for verdict in verdicts if verdict.outcome == "failed"}


@pytest.mark.parametrize("precision", PRECISIONS)
def test_exact_answers_pass(precision: str) -> None:
    rows, relations = as_read()
    answers = AnswerFile(rows={identity: exact(row, precision) for identity, row in rows.items()})

    assert [v for v in scored(rows, relations, answers, precision) if v.outcome != "passed"] == []


@pytest.mark.parametrize("off", [1, -1])
@pytest.mark.parametrize("precision", PRECISIONS)
def test_answers_that_are_off_by_more_than_their_limit_fail_in_every_row_that_has_one(precision: str, off: int) -> None:
    rows, _ = as_read()
    answers = AnswerFile(rows={identity: exact(row, precision, off=off) for identity, row in rows.items()})
    limited = {
        i for i, row in rows.items() if any(row[name] for name in row if name.startswith(f"limit{precision[-2:]}"))
    }

    verdicts = scored(rows, (), answers, precision)

    assert len(limited) > 500
    assert {verdict.id for verdict in verdicts if verdict.outcome == "failed"} == limited


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("slot", FILE_OF)
def test_the_default_formulas_fail_no_row_of_ordinary_scale(slot: str, precision: str) -> None:
    file = FILE_OF[slot]
    # Where only the ray by the inverse matrices asks for a slot, the eye's distance costs it digits (CAM-5).
    far = {
        i for i, row in everything()[0].items() if row.ladder == "CAM-FAR" and slot in ("view", "projection", "inverse")
    }

    assert {i for i in failed(f"{slot}/{FORMULAS.slots[slot]}", file, precision) - far if "extreme" not in i} == set()


def test_planted_faults_violate_a_vector() -> None:
    faults = [formula for formula in FORMULAS.values() if formula.kind == "fault"]
    seen = {
        fault.name
        for fault in faults
        if fault.slot in FILE_OF and any(failed(fault.name, FILE_OF[fault.slot], one) for one in PRECISIONS)
    }

    assert {fault.name for fault in faults} - seen == set(UNSEEN)
    assert len(seen) >= 0.95 * len(faults)


def test_every_formula_has_ladders_to_climb() -> None:
    asked = {slot for ladder in LADDERS for slot in ladder.slots}

    assert asked >= {
        "sphere",
        "cube",
        "plane",
        "square",
        "triangle",
        "ray",
        "shadow_ray",
        "falloff",
        "cosine",
        "nearest",
    }


def of_rows(identity: str, precision: str = "float32", **answer: str) -> str:
    """Return the outcome of one row by an answer."""
    rows, _ = as_read()
    declared = {name: answer.pop(name) for name in ("inside",) if name in answer}
    edge = float(answer.pop("edge", 0))
    return judged(
        identity, rows[identity], AnswerFile(rows={identity: answer}, edge=edge, **declared), precision
    ).outcome


def one(kind: str, file: str = "sphere") -> str:
    """Return the first row of a kind."""
    return next(
        i for i, row in everything()[0].items() if row.file == file and row.kind == kind and row.exact.start == "inside"
    )


def test_from_inside_t_is_what_the_file_declares() -> None:
    identity = one("inside")
    row = as_read()[0][identity]

    assert of_rows(identity, hit="1", t=row["t_out_low"]) == "passed"
    assert of_rows(identity, hit="1", t=row["t_in_low"]) == "failed"
    assert of_rows(identity, hit="1", t=row["t_in_low"], inside="near") == "passed"
    assert of_rows(identity, hit="1", t="0", inside="zero") == "passed"
    assert of_rows(identity, hit="1", t="0") == "failed"
    assert of_rows(identity, hit="1", t="nan") == "failed"
    assert of_rows(identity, hit="skip", t="") == "skipped"


def test_a_declared_tolerance_at_edges_takes_either_side() -> None:
    rows, _ = as_read()
    identity = next(i for i, row in rows.items() if "-triangle-" in i and row["why"] == "Beside an edge.")

    assert rows[identity]["decision32"] == "0"
    assert of_rows(identity, hit="1", t="1") == "failed"
    assert of_rows(identity, hit="1", t="1", edge=rows[identity]["clearance"]) == "passed"


def test_a_tie_never_fails_and_a_leak_does() -> None:
    rows, relations = as_read(["triangle"])
    relation = next(r for r in relations if r["relation"] == "at least one hit")
    missed = {i: {"hit": "0", "t": ""} for i in relation["rows"].split()}

    verdicts = scored(rows, [relation], AnswerFile(rows=missed), "float32")

    assert [(verdict.id, verdict.outcome) for verdict in verdicts if verdict.outcome == "failed"] == [
        (relation["id"], "failed")
    ]


def _wrong(tmp_path: Path, how: str) -> Path:
    cells = {i: dict(row) for i, row in of_formula("sphere/haines", "sphere", "float32").items()}
    path = written(tmp_path / "wrong.csv", cells)
    lines = path.read_text().splitlines()
    match how:
        case "short":
            del lines[5]
        case "doubled":
            lines.append(lines[5])
        case "unknown":
            lines.append("1-sphere-999,1,1")
        case "other version":
            lines = [lines[0], *(f"2{line[1:]}" for line in lines[1:])]
        case "no numbers":
            lines[5] = lines[5].split(",")[0] + ",yes,near"
        case "no column":
            lines = [line.rpartition(",")[0] for line in lines]
            lines[0] = "id,met"
        case "empty":
            lines = []
        case _:
            lines[3] += ",7"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("short", "1 rows have no answer, the first is 1-sphere-005"),
        ("doubled", "1-sphere-005 is answered twice"),
        ("unknown", "1-sphere-999 is no id"),
        (
            "other version",
            "1-sphere-001".replace("1-", "2-", 1) + " is of version 2 of the vectors, these are version 1",
        ),
        ("no numbers", "hit of 1-sphere-005 is no number: yes"),
        ("no column", "needs the column hit"),
        ("empty", "the first line must name the columns"),
        ("columns", "1-sphere-003 has 4 columns, the first line 3"),
    ],
)
def test_a_wrong_file_ends_in_one_line(tmp_path: Path, how: str, said: str) -> None:
    with pytest.raises(WrongFileError, match=said) as error:
        read_answers(_wrong(tmp_path, how), everything()[0])
    assert "\n" not in str(error.value)


@pytest.mark.process
def test_the_checker_needs_nothing_but_python_and_agrees(tmp_path: Path) -> None:
    write(tmp_path / "vectors", ["sphere"])
    answers = written(tmp_path / "answers.csv", of_formula("sphere/textbook", "sphere", "float32"), "name textbook")
    checker = [sys.executable, "-I", "-S", str(tmp_path / "vectors" / "check.py")]

    ended = run([*checker, str(answers)], capture_output=True, text=True, check=False)
    judgement = judge(read_answers(answers, everything()[0]), "float32")
    wrong = run([*checker, str(_wrong(tmp_path, "doubled"))], capture_output=True, text=True, check=False)

    fails = [verdict.id for verdict in judgement.verdicts if verdict.outcome == "failed"]
    assert ended.returncode == 1
    assert [line.split()[0] for line in ended.stdout.splitlines()[:-1]] == fails
    assert ended.stdout.splitlines()[-1].startswith("textbook, float32:")
    assert (wrong.returncode, wrong.stderr.count("\n")) == (2, 1)
    assert configured(formulas_of("sphere")[0], "float32").name.startswith("float32")
