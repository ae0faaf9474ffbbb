"""`rayproof laws`: exit codes, what it writes, and the planted faults that only laws were sure to see."""

import json
from pathlib import Path

import pytest

from rayproof.reports.cli import main
from rayproof.reports.results.document import load_results


@pytest.mark.process
def test_a_right_tracer_keeps_the_law_and_a_report_shows_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, file = tmp_path / "report", tmp_path / "laws.json"

    # The relation of `light_in_stages` is between numbers that are no stage's image: there is none to show of it.
    asked = ("light_split", "crop", "light_in_stages", "several_lights/inverse_square")
    code = main(["laws", *asked, "--out", str(out), "--json", str(file)])

    content = json.loads(file.read_text())
    assert code == 0, capsys.readouterr().out
    assert content["alarms"] == 0
    assert content["configurations"] == ["float32", "float64"]
    assert {row["law"]: row["verdict"] for row in content["laws"]} == dict.fromkeys(
        ("crop", "light_in_stages", "light_split"), "pass"
    )
    assert all(row["relations"] > 0 and 0 <= row["worst_over_Ku"] < 1 for row in content["laws"])
    cases = {case["family"]: case for case in load_results(out)["cases"]}
    assert {case["name"] for case in cases.values()} == {f"{law}/several_lights.inverse_square" for law in cases}
    split = cases["light_split"]
    assert cases["light_in_stages"]["renders"] == []
    assert {one["renderer"] for one in split["renders"]} == {"tracer-float32", "law"}
    assert len(json.loads((out / split["scene"]).read_text())["lights"]) == 11  # three others and eight parts
    assert (out / "index.html").is_file()
    assert "light_split" in (out / "junit.xml").read_text()


@pytest.mark.process
def test_a_broken_law_is_named_with_the_pixel_and_the_items(capsys: pytest.CaptureFixture[str]) -> None:
    code = main(
        [
            "laws",
            "light_caged",
            "simplified/shadows",
            "--formula",
            "obstructed=fault_never",
            "--configuration",
            "float32",
        ]
    )

    printed = capsys.readouterr().out
    assert code == 1
    assert printed.startswith("PLANTED FAULT IN USE")
    assert "BROKEN: light_caged, simplified/shadows" in printed
    assert "implicates LIT-1" in printed


@pytest.mark.process
def test_a_program_that_cannot_be_called_is_an_error_and_no_pass(tmp_path: Path) -> None:
    program = tmp_path / "program"
    program.write_text("#!/bin/sh\nexit 3\n")
    program.chmod(0o755)
    file = tmp_path / "laws.json"

    code = main(
        [
            "laws",
            "flux_power",
            "primitives/sphere",
            "--subject",
            f"exec:{program} {{scene}} {{output}}",
            "--json",
            str(file),
        ]
    )

    content = json.loads(file.read_text())
    assert code == 3
    assert content["errors"] == 1
    assert content["laws"][0]["verdict"] == "error"
    assert "exit code 3" in content["laws"][0]["problems"][0]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["no_such_law"], "no_such_law"),
        (["split", "--jobs", "0"], "--jobs must be at least 1, got 0"),
        (["split", "--subject", "nobody"], "nobody"),
        (["split", "--subject", "embree", "--formula", "triangle=signed_areas"], "--configuration and --formula"),
    ],
)
def test_bad_usage_is_one_line(arguments: list[str], named: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["laws", *arguments]) == 2

    told = capsys.readouterr().err.strip().splitlines()
    assert len(told) == 1
    assert named in told[0]


@pytest.mark.process
def test_the_oracle_may_be_held_against_itself(tmp_path: Path) -> None:
    file = tmp_path / "laws.json"

    code = main(["laws", "mirror", "several_lights/inverse_square", "--subject", "analytic", "--json", str(file)])

    content = json.loads(file.read_text())
    assert (code, content["subject"], content["alarms"]) == (0, "analytic", 0)
    assert content["relations"] > 0
