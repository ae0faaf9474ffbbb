"""`rayproof run --expect` and `rayproof expect`: a known failure passes the gate, and every output names it."""

import json
from pathlib import Path

import pytest

from rayproof.reports.cli import main
from rayproof.reports.results.document import load_results

CASE = "primitives/sphere"
FAULTY = ["--configuration", "float32/lambert=fault_missing"]


def test_a_known_failure_is_accepted_let_through_and_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    known, out = tmp_path / "known.json", tmp_path / "report"
    assert main(["run", CASE, *FAULTY, "--out", str(out)]) == 1
    accept = ["expect", "accept", str(out), "--file", str(known)]
    assert main(accept) == 2
    assert "--reason" in capsys.readouterr().err
    assert main([*accept, "--reason", "The cosine is left out on purpose."]) == 0

    code = main(["run", CASE, *FAULTY, "--out", str(out), "--expect", str(known)])

    said = capsys.readouterr().out
    gate = load_results(out)["gate"]
    assert (code, gate["red"], gate["regressions"]) == (0, False, [])
    assert len(gate["matched"]) == len(json.loads(known.read_text())["expected"]) > 0
    assert f"The gate {known} is open" in said
    assert "The cosine is left out on purpose." in (out / "summary.md").read_text()
    junit = (out / "junit.xml").read_text()
    assert 'failures="0"' in junit
    assert "expected: fail" in junit
    assert "::error title=rayproof primitives" not in (out / "annotations.txt").read_text()
    # One expectation fewer, and what is not in the file any more is a regression.
    content = json.loads(known.read_text())
    known.write_text(json.dumps(content | {"expected": content["expected"][1:]}))
    assert main(["expect", "check", str(out), "--file", str(known)]) == 1
    assert "no entry is about it" in capsys.readouterr().out


def test_a_bad_file_of_expectations_ends_before_anything_is_done(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    known = tmp_path / "known.json"
    known.write_text("[]")

    code = main(["run", CASE, "--out", str(tmp_path / "report"), "--expect", str(known)])

    assert code == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "report").exists()
