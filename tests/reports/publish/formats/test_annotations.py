"""Annotations: one line for each of ten causes, and no name can begin a command of its own."""

from pathlib import Path

from rayproof.reports.publish.summaries import publish_annotations as publish
from tests.reports.publish.sample import make_folder, results_of


def test_a_cause_is_annotated_once_with_the_number_of_its_cases_and_the_programs_own_name(tmp_path: Path) -> None:
    failing = next(case for case in make_folder(tmp_path)["cases"] if case["verdict"] == "fail")
    why = {"reason": "exec against analytic, normal: off"}
    many = results_of([failing | {"name": f"many/{number}"} | why for number in range(25)])
    many |= {"configurations": ["exec"], "declared": {"name": "mine 1.2"}}

    (path,) = publish(tmp_path, many)

    (line,) = [line for line in path.read_text().splitlines() if "many/" in line]
    assert line.startswith("::error title=rayproof many/0 and 24 more cases::fail (12 of 4,000 pixels wrong at")
    assert line.endswith("mine 1.2 against analytic, normal: off")


def test_a_hostile_name_begins_no_command(tmp_path: Path) -> None:
    failing = next(case for case in make_folder(tmp_path)["cases"] if case["verdict"] == "fail")
    hostile = failing | {"name": "a/b\n::set-output name=x::y\r::error::%0A,z", "reason": "one\ntwo::three"}

    (path,) = publish(tmp_path, results_of([hostile]))

    assert len(path.read_text().splitlines()) == 2
    assert "%250A%2Cz" in path.read_text()


def test_new_accepted_and_mended_are_annotated_apart(tmp_path: Path) -> None:
    results = make_folder(tmp_path)
    gate = {
        "file": "known.json", "sentence": "", "red": True, "regressions": ["sphere/sheared: no entry is about it"],
        "tighten": ["plane/tilted: float32 analytic ray passes now"], "stale": [], "expired": [], "matched": [],
        "cases": ["lights/acne", "lights/broken"],
    }  # fmt: skip

    (path,) = publish(tmp_path, results | {"gate": gate})

    lines = path.read_text().splitlines()
    (new,) = [line for line in lines if line.startswith("::error title=rayproof sphere/sheared")]
    assert "new: fail (12 of 4,000 pixels wrong at normal, by 0.017 on average" in new
    notices = [line for line in lines if line.startswith("::notice")]
    assert notices[0].startswith("::notice title=rayproof::accepted: 2 cases: visibility LIT-5 (against acne")
    assert notices[0].endswith(", and 1 more cause")
    assert notices[1] == "::notice title=rayproof::mended: 1: plane/tilted: float32 analytic ray passes now"
    assert not any("inf)" in line for line in lines)
