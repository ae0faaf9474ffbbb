"""Annotations: the worst ten, one line each, and no name can begin a command of its own."""

from pathlib import Path

from rayproof.reports.publish.summaries import MOST
from rayproof.reports.publish.summaries import publish_annotations as publish
from tests.reports.publish.sample import make_folder, results_of


def test_what_did_not_pass_is_annotated(tmp_path: Path) -> None:
    (path,) = publish(tmp_path, make_folder(tmp_path))

    lines = path.read_text().splitlines()
    assert all(line.startswith(("::error title=", "::notice title=")) for line in lines)
    assert any(line.startswith("::error title=rayproof sphere/sheared::fail") and "NRM-3" in line for line in lines)
    assert not any("sphere/plain" in line for line in lines)


def test_only_the_worst_ten_are(tmp_path: Path) -> None:
    results = make_folder(tmp_path)
    failing = next(case for case in results["cases"] if case["verdict"] == "fail")
    many = results_of([failing | {"name": f"many/{number}"} for number in range(25)])

    (path,) = publish(tmp_path, many)

    lines = path.read_text().splitlines()
    assert len([line for line in lines if "many/" in line]) == MOST
    assert "The worst 10 of 25" in lines[-1]


def test_a_run_that_passes_gives_a_notice(tmp_path: Path) -> None:
    passing = [case for case in make_folder(tmp_path)["cases"] if case["verdict"] == "pass"]

    (path,) = publish(tmp_path, results_of(passing))

    assert path.read_text().startswith("::notice title=rayproof::1 case: all pass")


def test_a_hostile_name_begins_no_command(tmp_path: Path) -> None:
    failing = next(case for case in make_folder(tmp_path)["cases"] if case["verdict"] == "fail")
    hostile = failing | {"name": "a/b\n::set-output name=x::y\r::error::%0A,z", "reason": "one\ntwo::three"}

    (path,) = publish(tmp_path, results_of([hostile]))

    assert len(path.read_text().splitlines()) == 2
    assert "%250A%2Cz" in path.read_text()
