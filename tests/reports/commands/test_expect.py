"""`rayproof run --expect` and `rayproof gate`: a known failure passes the gate, and every output names it."""

import json
from pathlib import Path

import pytest

from rayproof.reports.cli import main
from rayproof.reports.results.document import load_results

pytestmark = pytest.mark.process

CASE = "primitives/sphere"
FAULTY = ["--configuration", "float32/lambert=fault_missing"]


def test_a_known_failure_is_accepted_let_through_and_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    known, out = tmp_path / "known.json", tmp_path / "report"
    assert main(["run", CASE, *FAULTY, "--out", str(out)]) == 1
    accept = ["gate", "accept", str(out), "--file", str(known)]
    assert main(accept) == 2
    assert "--reason" in capsys.readouterr().err
    assert main([*accept, "--reason", "The cosine is left out on purpose."]) == 0

    code = main(["run", CASE, *FAULTY, "--out", str(out), "--expect", str(known)])

    said = capsys.readouterr().out
    gate = load_results(out)["gate"]
    assert (code, gate["red"], gate["regressions"]) == (0, False, [])
    content = json.loads(known.read_text())
    assert len(gate["matched"]) == len(content["expected"]) == 1  # one entry for a case and item
    assert f"The gate {known} is green" in said
    assert "The cosine is left out on purpose." in (out / "summary.md").read_text()
    junit = (out / "junit.xml").read_text()
    assert 'failures="0"' in junit
    assert "expected: fail" in junit
    assert "::error title=rayproof primitives" not in (out / "annotations.txt").read_text()
    # Held against the run before, of which nothing became worse, and against a coverage that no run has.
    better = ["run", CASE, "--configuration", "float32/lambert=cosine", "--out", str(tmp_path / "right")]
    assert main([*better, "--history", str(tmp_path / "h.sqlite")]) == 0
    assert main(["run", CASE, *FAULTY, "--out", str(out), "--against", str(out)]) == 0
    for base in (tmp_path / "right", tmp_path / "h.sqlite"):
        assert main(["run", CASE, *FAULTY, "--out", str(out), "--expect", str(known), "--against", str(base)]) == 1
        assert load_results(out)["gate"]["worse"]
    check = ["gate", "check", str(out), "--file", str(known)]
    assert main(check) == 0
    assert main([*check, "--least-coverage", "99"]) == (0 if load_results(out)["checks"]["unsupported"] == 0 else 1)
    # One expectation fewer, and what is not in the file any more is a regression.
    checks = content["expected"][0]["cases"][CASE]["checks"]
    assert all(int(cells, 16) for group in checks.values() for _, wrong, _, cells in group.values() if wrong)
    checks.popitem()
    known.write_text(json.dumps(content))
    assert main(["gate", "check", str(out), "--file", str(known)]) == 1
    assert "no entry is about it" in capsys.readouterr().out


def test_selectors_and_a_cause_are_accepted_with_a_reason_each(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    known, out = tmp_path / "known.json", tmp_path / "report"
    assert main(["run", CASE, "primitives/cube", "primitives/plane", *FAULTY, "--out", str(out)]) == 1
    accept = ["gate", "accept", str(out), "--file", str(known)]
    assert main([*accept, "shadows", "--reason", "None."]) == 2
    assert "no failing case of the run matches shadows" in capsys.readouterr().err
    assert main([*accept, "--cause", "no_such"]) == 2
    (diagnosis,) = load_results(out)["diagnosis"]
    assert f"names no cause no_such; it names {diagnosis['mistake']}" in capsys.readouterr().err

    assert main([*accept, "primitives/s*", "--reason", "The sphere is special."]) == 0
    assert main([*accept, "--cause", str(diagnosis["mistake"])]) == 0

    first, second = json.loads(known.read_text())["expected"]
    assert (first["reason"], [*first["cases"]]) == ("The sphere is special.", [CASE])
    assert (second["reason"], [*second["cases"]]) == (diagnosis["sentence"], ["primitives/cube", "primitives/plane"])
    assert second["cause"] == diagnosis["mistake"]
    assert main(["gate", "check", str(out), "--file", str(known)]) == 0
    assert main(["gate", "check", str(out), CASE, "--file", str(known)]) == 2


def test_a_bad_file_of_expectations_ends_before_anything_is_done(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    known = tmp_path / "known.json"
    known.write_text("[]")

    code = main(["run", CASE, "--out", str(tmp_path / "report"), "--expect", str(known)])

    assert code == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "report").exists()
