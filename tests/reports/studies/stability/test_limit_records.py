"""Limits as files, tables, bars and gates."""

import csv
from copy import deepcopy
from pathlib import Path

import pytest

from rayproof.reports.cli import main
from rayproof.reports.publish.page import plots
from rayproof.reports.studies.stability.limit_records import (
    LimitRecord,
    LimitsError,
    LimitsRecord,
    changes,
    load_limits,
    table,
    worse,
    write_limits,
)


def limit(renderer: str, reached: float | None, breaks_at: float | None) -> LimitRecord:
    return {
        "renderer": renderer,
        "ladder": "offset",
        "limit": reached,
        "breaks_at": breaks_at,
        "verdict": "pass" if breaks_at is None else "fail",
        "stage": "" if breaks_at is None else "normal",
        "items": [] if breaks_at is None else ["XF-1", "XF-2", "NRM-1", "NRM-3"],
        "reason": "",
        "monotone": True,
        "rungs": [],
    }


DOCUMENT: LimitsRecord = {
    "schema": 1,
    "subject": "mine",
    "renderers": ["mine", "radiance"],
    "ladders": [
        {"ladder": "offset", "quantity": "Offset", "unit": "m", "values": [1.0, 10.0, 100.0, 1000.0], "control": True}
    ],
    "limits": [limit("mine", 10.0, 100.0), limit("radiance", 1000.0, None)],
    "environment": {},
}


def with_limit(reached: float | None) -> LimitsRecord:
    found = deepcopy(DOCUMENT)
    found["limits"][0]["limit"] = reached
    return found


def test_the_table_names_unit_and_blamed_items_and_the_others() -> None:
    columns, rows = table(DOCUMENT)

    assert columns[-1] == "radiance"
    assert rows == [["offset", "Offset", "m", "10", "normal: XF-1, XF-2, NRM-1, ...", "all, 1000"]]


def test_files_are_read_again_and_drawn_on_a_logarithmic_axis(tmp_path: Path) -> None:
    write_limits(tmp_path / "stability", DOCUMENT)
    first = next(csv.DictReader((tmp_path / "stability" / "limits.csv").read_text().splitlines()))
    drawn = plots.limits(tmp_path)

    assert load_limits(tmp_path) == DOCUMENT
    assert (first["renderer"], first["limit"], first["items"]) == ("mine", "10.0", "XF-1 XF-2 NRM-1 NRM-3")
    assert drawn is not None
    assert [bar["share"] for bar in drawn["bars"]] == [pytest.approx(1 / 3, abs=1e-4), 1.0]


def test_a_file_without_limits_is_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "empty.json").write_text("{}")

    with pytest.raises(LimitsError, match="no limits"):
        load_limits(tmp_path / "empty.json")


@pytest.mark.parametrize(("after", "rungs", "lower"), [(1.0, -1, 1), (10.0, 0, 0), (1000.0, 2, 0), (None, -2, 1)])
def test_two_are_compared_by_rungs(after: float | None, rungs: int, lower: int) -> None:
    found = changes(DOCUMENT, with_limit(after))

    assert [one["rungs"] for one in found] == [rungs]
    assert len(worse(found)) == lower


def test_a_limit_below_the_first_rung_is_never_right() -> None:
    assert worse(changes(DOCUMENT, with_limit(None))) == ["offset, right up to [m]: 10 before, never right now"]


def test_a_ladder_that_is_missing_counts_as_lost() -> None:
    other = deepcopy(DOCUMENT)
    other["ladders"], other["limits"] = [], []

    assert changes(DOCUMENT, other)[0]["rungs"] == -2


def test_report_compares_two_folders(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_limits(tmp_path / "before" / "stability", DOCUMENT)
    write_limits(tmp_path / "after" / "stability", with_limit(1.0))

    assert main(["report", str(tmp_path / "before"), str(tmp_path / "after"), "--json", str(tmp_path / "c.json")]) == 0
    assert "1 limit: 0 higher and 1 lower" in capsys.readouterr().out
    assert "-1" in (tmp_path / "c.json").read_text()


@pytest.mark.process
def test_against_is_a_gate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["limits", "--subject", "tracer", "--quick", "tall", "--out", str(tmp_path / "now")]
    assert main(words) == 0
    found = load_limits(tmp_path / "now")
    assert found["limits"][0]["limit"] == 36.0
    assert main([*words, "--against", str(tmp_path / "now")]) == 0
    found["ladders"][0]["values"].append(72.0)
    found["limits"][0]["limit"] = 72.0
    write_limits(tmp_path / "other", found)
    assert main([*words, "--against", str(tmp_path / "other" / "limits.json")]) == 2
    assert "other rungs" in capsys.readouterr().err


@pytest.mark.process
def test_a_program_without_an_image_is_asked_once_a_ladder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = tmp_path / "blind.py"
    program.write_text("import sys\nsys.exit('no image today')\n")
    subject = f"exec:python3 {program} {{scene}} {{output}}"

    assert main(["limits", "--subject", subject, "--quick", "tall", "--out", str(tmp_path)]) == 3
    assert [one["verdict"] for one in load_limits(tmp_path)["limits"][0]["rungs"]] == ["error"]
    assert "no image today" in capsys.readouterr().out


@pytest.mark.parametrize("words", [["sphere"], ["--against", "x"], ["--subject", "nobody"]])
def test_bad_usage(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["limits", *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1
