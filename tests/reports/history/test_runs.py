"""Two finished runs: changed verdicts are named, moved errors counted in digits."""

import copy
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from rayproof.reports.history.run_difference import compare_runs
from rayproof.reports.results.document import save_results
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
    save_results(folder, results)
    return folder


def test_a_run_against_itself_shows_nothing(tmp_path: Path, before: Results) -> None:
    result = compare_runs(tmp_path / "before", write(tmp_path / "after", before))

    assert result["outcome"] == "no difference shown"
    assert result["changed"] == []


def scaled(results: Results, factor: float) -> Results:
    """Return results whose errors are `factor` times as large."""
    other = copy.deepcopy(results)
    for case in other["cases"]:
        for place, check in enumerate(case["checks"]):
            if (measured := check.end_to_end) is not None:
                measured = replace(measured, worst_error=measured.worst_error * factor)
            case["checks"][place] = replace(check, end_to_end=measured, ratio=check.ratio * factor)
    return other


def in_families(results: Results, number: int) -> Results:
    """Return results of which each measured case is there once in each of so many families."""
    measured = [case for case in results["cases"] if case["checks"]]
    cases = [
        copy.deepcopy(case) | {"family": f"f{family}", "name": f"f{family}/{place}"}
        for family in range(number)
        for place, case in enumerate(measured)
    ]
    return results | {"cases": cases}


def test_errors_ten_times_smaller_are_a_digit(tmp_path: Path, before: Results) -> None:
    results = in_families(before, 6)
    folders = write(tmp_path / "before", results), write(tmp_path / "after", scaled(results, 0.1))

    result = compare_runs(*folders)

    assert result["outcome"] == "better"
    assert result["digits_gained"] == pytest.approx(1)


def test_a_family_that_lost_digits_makes_it_mixed_and_is_named_first(tmp_path: Path, before: Results) -> None:
    results = in_families(before, 8)
    after = scaled(results, 0.1)
    worse = scaled(results, 3)
    after["cases"] = [b if b["family"] == "f5" else a for a, b in zip(after["cases"], worse["cases"], strict=True)]

    result = compare_runs(write(tmp_path / "before", results), write(tmp_path / "after", after))

    assert result["digits_interval"][0] > 0
    assert result["outcome"] == "mixed"
    assert "verdicts changed; errors grew in f5 (-0.48 digits); worst errors +0." in result["verdict"]


def test_an_error_that_moved_by_a_hundredth_is_no_difference(tmp_path: Path, before: Results) -> None:
    results = in_families(before, 6)
    folders = write(tmp_path / "before", results), write(tmp_path / "after", scaled(results, 0.99))

    result = compare_runs(*folders)

    assert result["digits_interval"][0] > 0
    assert result["outcome"] == "no difference shown"


def test_a_configuration_is_compared_with_one_other_alone(tmp_path: Path, before: Results) -> None:
    def run(name: str, *errors: tuple[str, float]) -> Path:
        case = copy.deepcopy(next(case for case in before["cases"] if case["verdict"] == "pass"))
        (check, *_) = [one for one in case["checks"] if one.reference == "analytic"]
        measured = check.end_to_end
        case["checks"] = [
            replace(check, configuration=name, end_to_end=replace(measured, worst_error=error))
            for name, error in errors
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
