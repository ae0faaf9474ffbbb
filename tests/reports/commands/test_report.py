"""`rayproof report`: a folder published again, two folders compared, and bad folders refused in one line."""

import importlib
import json
import math
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from rayproof.reports.cli import main
from rayproof.reports.commands import report as command
from rayproof.reports.results.case_table import CaseTable
from rayproof.reports.results.document import load_results, save_results
from tests.reports.checks import recorded
from tests.reports.publish.sample import make_folder


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a results folder."""
    folder = tmp_path_factory.mktemp("run")
    make_folder(folder)
    return folder


def test_a_folder_is_published_as_one_file_too(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(run), "--single-file"]) == 0

    assert f"single file: {run / 'report.html'} (0." in capsys.readouterr().out
    assert (run / "index.html").stat().st_size < (run / "report.html").stat().st_size

    # An old one would tell of another run.
    (run / "report.html").write_text("old")
    assert main(["report", str(run)]) == 0
    assert (run / "report.html").stat().st_size > 1000


def test_two_runs_are_compared_in_the_terminal_and_as_json(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = make_folder(tmp_path)
    results["cases"][0]["verdict"] = "fail"
    save_results(tmp_path, results)

    assert main(["report", str(run), str(tmp_path), "--json", str(tmp_path / "both.json")]) == 0

    out = capsys.readouterr().out
    assert "pass -> fail" in out
    assert "1 of 9 verdicts changed, 1 for the worse" in out
    assert json.loads((tmp_path / "both.json").read_text())["rows"][0]["case"] == "sphere/plain"
    assert not (tmp_path / "index.html").exists()


@pytest.mark.parametrize("words", [["report", "{folder}"], ["gate", "accept", "{folder}", "--file", "{folder}/k.json"]])
def test_a_damaged_record_is_told_in_one_line(
    words: list[str], run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = load_results(run)
    table = CaseTable(tmp_path / "results.sqlite")
    for place, case in enumerate(results["cases"]):
        table.keep(case["name"], case, place=place)
    save_results(tmp_path, {**results, "cases": table.cases()})
    (tmp_path / "results.json").unlink()
    with closing(sqlite3.connect(tmp_path / "results.sqlite")) as connection:
        connection.execute("UPDATE cases SET record = x'0011' WHERE place = 3")
        connection.commit()

    assert main([word.format(folder=tmp_path) for word in words]) == 2

    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "results.sqlite: holds a damaged record" in told


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["{run}", "{empty}", "--out", "{empty}/both"], "results.json: no such file"),
        (["{empty}", "{run}"], "results.json: no such file"),
        (["{run}", "{broken}"], "not JSON"),
        (["{run}", "{run}", "--out", "{run}"], "is the folder of one of the two runs"),
        (["{run}", "{run}", "--single-file"], "--single-file needs --out"),
        (["{run}", "--out", "{empty}"], "need the folders of two runs"),
    ],
)
def test_bad_folders_are_one_line_and_2(
    run: Path, tmp_path: Path, arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    empty, broken = tmp_path / "empty", tmp_path / "broken"
    empty.mkdir()
    broken.mkdir()
    (broken / "results.json").write_text("{")

    given = [text.format(run=run, empty=empty, broken=broken) for text in arguments]

    assert main(["report", *given]) == 2
    told = capsys.readouterr()
    assert said in told.err
    assert told.err.count("\n") == 1
    assert told.out == ""


def test_checks_are_written_as_columns(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arrow = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed: ./rayproof install parquet")

    assert main(["report", str(run), "--parquet", str(tmp_path / "checks.parquet")]) == 0

    cases = load_results(run)["cases"]
    rows = arrow.read_table(tmp_path / "checks.parquet").to_pylist()
    told = [(case["name"], check.stage, check.outcome) for case in cases for check in case["checks"]]
    assert [(row["case"], row["stage"], row["verdict"]) for row in rows] == told
    assert f"checks: {len(told)} in " in capsys.readouterr().out
    measured = [check.end_to_end for case in cases for check in case["checks"]]
    worst = [None if one is None else one.worst_error for one in measured]
    assert [row["worst_error"] for row in rows] == pytest.approx(worst, nan_ok=True, rel=0, abs=0)
    assert any(row["worst_error"] for row in rows)


def test_each_column_has_its_own_numbers_in_however_many_groups(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    arrow = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed: ./rayproof install parquet")
    columns = importlib.import_module("rayproof.reports.results.parquet")
    monkeypatch.setattr(columns, "ROWS", 2)
    measured = {"worst_error": 1e-3, "limit": 2e-3, "pixel": [7, 3], "interior": 90, "edge": 6}
    words = {"configuration": "float32", "reference": "radiance", "verdict": "fail", "reason": "it is off"}
    checks = [recorded(**words, stage=stage, ratio="inf", end_to_end=measured) for stage in ("ray", "object", "normal")]
    results = {"cases": [{"name": "walls/far", "family": "walls", "checks": checks}]}

    assert columns.write_checks(tmp_path / "checks.parquet", results) == 3

    rows = arrow.read_table(tmp_path / "checks.parquet").to_pylist()
    numbers = {"worst_error": 1e-3, "limit": 2e-3, "column": 7, "row": 3, "interior": 90, "edge": 6}
    whole = {"case": "walls/far", "family": "walls", "ratio": math.inf, **words, **numbers}
    assert rows == [{**whole, "stage": stage} for stage in ("ray", "object", "normal")]


def test_columns_without_their_package_are_refused(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "find_spec", lambda name: None)

    assert main(["report", str(run), "--parquet", str(tmp_path / "checks.parquet")]) == 2
    assert "./rayproof install parquet" in capsys.readouterr().err
