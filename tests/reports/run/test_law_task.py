"""Laws in a run: what a record says of them, how a run ends, and the planted faults that only laws see."""

import math
from pathlib import Path
from typing import Any

import pytest

from rayproof.cases.laws import LAWS, USUAL
from rayproof.cases.stages import Stage
from rayproof.reports.cli import main
from rayproof.reports.judge.laws import Judged, LawReport, with_laws
from rayproof.reports.results.case_records import BY_LAWS
from rayproof.reports.results.compact import compact_case
from rayproof.reports.results.document import load_results
from rayproof.reports.results.files import as_json
from rayproof.reports.run.options import laws_among


def judged(out: Path, *arguments: str) -> tuple[int, dict[str, Any]]:
    """Run with laws; return the exit code and the document."""
    code = main(["run", *arguments, "--laws", "--out", str(out), "--no-cache", "--diagnose", "off"])
    return code, load_results(out)


@pytest.mark.process
def test_a_right_tracer_keeps_the_laws(tmp_path: Path) -> None:
    # `crop` says nothing of what the other concerns, so that each has stages of its own.
    code, results = judged(tmp_path, "light_split", "crop", "several_lights/inverse_square")

    (case,) = results["cases"]
    checks = [check for check in case["checks"] if check.reference == BY_LAWS]
    assert code == 0
    assert {(row["law"], row["configuration"], row["verdict"]) for row in case["laws"]} == {
        (law, name, "pass") for law in ("crop", "light_split") for name in ("float32", "float64")
    }
    assert all(row["relations"] > 0 for row in case["laws"])
    assert {(check.configuration, check.outcome) for check in checks} == {
        ("float32", "pass"),
        ("float64", "pass"),
    }
    assert {"ray", "irradiance"} <= {check.stage for check in checks}
    assert all(0 <= check.ratio < 1 and check.end_to_end.pixel is None for check in checks)
    assert all(BY_LAWS not in entry["references"] for entry in results["coverage_detail"].values())
    assert case["reproduce"].endswith("run several_lights/inverse_square crop light_split --laws")


@pytest.mark.process
def test_a_fault_that_no_reference_sees_in_a_case_breaks_a_law(tmp_path: Path) -> None:
    faulty = ("--configuration", "float32", "--formula", "obstructed=fault_never")

    code, results = judged(tmp_path, "light_caged", "primitives/plane", *faulty)

    (case,) = results["cases"]
    assert code == 1
    assert {check.reference for check in case["checks"] if check.outcome == "fail"} == {BY_LAWS}
    assert (case["verdict"], case["stage"], case["blamed_items"]) == ("fail", "irradiance", ["LIT-1", "LIT-3", "LIT-5"])
    assert case["reason"].startswith("law light_caged is broken (")
    assert "at pixel (" in case["reason"]
    assert f"{BY_LAWS} irradiance: fail: " in (tmp_path / "junit.xml").read_text()


@pytest.mark.process
def test_a_program_that_cannot_be_called_is_an_error_and_no_pass(tmp_path: Path) -> None:
    program = tmp_path / "program"
    program.write_text("#!/bin/sh\nexit 3\n")
    program.chmod(0o755)

    code, results = judged(
        tmp_path / "out", "flux_power", "primitives/sphere", "--subject", f"exec:{program} {{scene}} {{output}}"
    )

    ((row,),) = (case["laws"] for case in results["cases"])
    assert code == 3
    assert row["verdict"] == "error"
    assert "exit code 3" in row["reason"]


@pytest.mark.process
def test_a_run_in_which_no_law_has_anything_to_say_measured_nothing(tmp_path: Path) -> None:
    code, results = judged(tmp_path, "split", "primitives/sphere", "--configuration", "float32")

    assert (code, results["verdict"], results["cases"][0]["laws"][0]["verdict"]) == (3, "pass", "undecided")


def test_a_plan_says_how_often_a_law_is_put_to_a_configuration(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "split", "primitives/sphere", "--laws", "--dry-run"]) == 0

    assert " checks, 2 laws put\n" in capsys.readouterr().out


def test_an_unknown_law_is_bad_usage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "no_such_law", "--laws", "--out", str(tmp_path)]) == 2

    assert "no_such_law" in capsys.readouterr().err


def test_the_choice_puts_named_laws_to_named_cases_and_others_to_the_usual_ones() -> None:
    named = laws_among(["split", "meshes/torus"])
    alone = laws_among(["anchor_*"])
    cases, every = laws_among(["meshes"])

    assert (named[0], named[1].of("meshes/torus", first=False)) == (("meshes/torus",), ("split",))
    assert (alone[0], len(alone[1].of("primitives/sphere", first=False))) == (("primitives/sphere",), 4)
    assert cases == ("meshes",)
    assert set(every.of("meshes/torus", first=True)) == {*LAWS}
    assert not any(LAWS.about(law).get("own", False) for law in every.of("meshes/torus", first=False))
    assert laws_among([])[1].of("cameras/portrait", first=True) == ("resolution",)
    assert {law for law, _ in USUAL} <= {*LAWS}


def test_the_worst_law_of_a_stage_makes_its_check_and_blames_what_all_broken_ones_speak_of() -> None:
    right = Judged(stage=Stage.RAY, what="as it is", examined=9, excused=1, outside=0, worst=0.5, pixel=None)
    wrong = Judged(
        stage=Stage.VISIBILITY, what="a light in a cage", examined=9, excused=0, outside=2, worst=float("inf"),
        pixel=(3, 4), expected=(0.0,), measured=(1.0,),
    )  # fmt: skip
    reports = [
        LawReport(law="crop", configuration="mine", judged=(right,)),
        LawReport(law="light_caged", configuration="mine", judged=(right, wrong)),
        LawReport(law="light_hidden", configuration="mine", judged=(wrong,)),
        LawReport(law="roll", configuration="mine", error="it fell"),
        LawReport(law="scale", configuration="mine", unsupported="It has no lights."),
        LawReport(law="split", configuration="mine"),
    ]

    record = with_laws({"name": "a/b", "family": "a", "verdict": "pass", "checks": [], "planned": 0}, reports)

    assert [(check.stage, check.outcome, check.ratio) for check in record["checks"]] == [
        ("ray", "error", 0.5), ("visibility", "fail", math.inf),
    ]  # fmt: skip
    assert (record["planned"], record["verdict"], record["blamed_items"], record["item"]) == (
        2,
        "fail",
        ["LIT-1"],
        "LIT-1",
    )
    assert [check.examined.wrong for check in record["checks"]] == [0, 4]  # a gate holds a law to them
    assert "light_caged" in record["reason"]
    assert "light_hidden" in record["reason"]
    assert [row["verdict"] for row in record["laws"]] == ["pass", "fail", "fail", "error", "unsupported", "undecided"]
    assert as_json(compact_case(record))


def test_a_broken_law_leaves_a_failure_before_references_as_it_is() -> None:
    failed = {"name": "a/b", "family": "a", "verdict": "fail", "stage": "ray", "reason": "it is off", "item": "CAM-4"}
    wrong = Judged(stage=Stage.OBJECT, what="a change", examined=9, excused=9, outside=0, worst=0.0, pixel=None)

    record = with_laws(
        {**failed, "checks": [], "planned": 0}, [LawReport(law="split", configuration="m", judged=(wrong,))]
    )

    assert failed.items() <= record.items()
    assert record["checks"][0].reason.startswith("law split is broken (a change): 9 of 9 pixels")
