"""`rayproof report`: a folder published again, two folders compared, and bad folders refused in one line."""

import json
from pathlib import Path

import pytest

from rayproof.reports.cli import main
from rayproof.reports.results.document import save_results
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
