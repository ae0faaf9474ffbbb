"""Two finished runs: changed verdicts are named, moved errors counted in digits."""

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.runs.difference.runs import compare_runs
from tests.reports.commands.conftest import Rayproof
from tests.reports.publish.sample import make_folder

Results = dict[str, Any]


@pytest.fixture
def before(tmp_path: Path) -> Results:
    results = make_folder(tmp_path / "before")
    write(tmp_path / "before", results)
    return copy.deepcopy(results)


def write(folder: Path, results: Results) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "results.json").write_text(json.dumps(results))
    return folder


def test_a_run_against_itself_shows_nothing(tmp_path: Path, before: Results) -> None:
    result = compare_runs(tmp_path / "before", write(tmp_path / "after", before))

    assert result["outcome"] == "no difference shown"
    assert result["changed"] == []


def test_errors_ten_times_smaller_are_a_digit(tmp_path: Path, before: Results) -> None:
    for case in before["cases"]:
        for check in case["checks"]:
            if check["end_to_end"] and isinstance(check["end_to_end"]["worst_error"], float):
                check["end_to_end"]["worst_error"] /= 10

    result = compare_runs(tmp_path / "before", write(tmp_path / "after", before))

    assert result["outcome"] == "better"
    assert result["digits_gained"] == pytest.approx(1)


def test_an_error_that_moved_by_a_hundredth_is_no_difference(tmp_path: Path, before: Results) -> None:
    for case in before["cases"]:
        for check in case["checks"]:
            if check["end_to_end"] and isinstance(check["end_to_end"]["worst_error"], float):
                check["end_to_end"]["worst_error"] *= 0.99

    result = compare_runs(tmp_path / "before", write(tmp_path / "after", before))

    assert result["digits_interval"][0] > 0
    assert result["outcome"] == "no difference shown"


def test_a_configuration_is_compared_with_one_other_alone(tmp_path: Path, before: Results) -> None:
    def run(name: str, *errors: tuple[str, float]) -> Path:
        case = copy.deepcopy(next(case for case in before["cases"] if case["verdict"] == "pass"))
        (check, *_) = [one for one in case["checks"] if one["reference"] == "analytic"]
        measured = check["end_to_end"]
        case["checks"] = [
            {**check, "configuration": name, "end_to_end": {**measured, "worst_error": error}} for name, error in errors
        ]
        configurations = [name for name, _ in errors]
        return write(tmp_path / name, before | {"cases": [case], "configurations": configurations})

    one, other = run("one", ("a", 1e-3), ("b", 1e-6)), run("other", ("b", 1e-6), ("c", 1e-4))

    assert compare_runs(one, other)["digits_gained"] == pytest.approx(0.5)  # of a to c 1, of b to b 0


def test_a_changed_verdict_is_named(rayproof: Rayproof, tmp_path: Path, before: Results) -> None:
    passed = next(case for case in before["cases"] if case["verdict"] == "pass")
    passed["verdict"] = "fail"
    before["summary"]["pass"] -= 1
    before["summary"]["fail"] += 1
    write(tmp_path / "after", before)

    ended = rayproof("compare", tmp_path / "before", tmp_path / "after")

    assert ended.code == 0
    assert ended.out.startswith("Worse")
    assert f"{passed['name']} pass -> fail" in ended.out


def test_a_run_is_compared_with_runs_only(rayproof: Rayproof, tmp_path: Path, before: Results) -> None:
    ended = rayproof("compare", tmp_path / "before", "sphere/haines")

    assert ended.code == 2
    assert ended.error.count("\n") == 1
