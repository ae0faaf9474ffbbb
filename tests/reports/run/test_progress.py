"""The table at the end of a run: the worst first, and no error where none was measured."""

import io
from typing import Any

import pytest

from rayproof.reports.run import progress
from rayproof.reports.run.progress import CaseProgress, highest, worst_first
from rayproof.reports.terminal import Page
from tests.reports.checks import recorded


def record(name: str, verdict: str, *ratios: float | str | None) -> dict[str, Any]:
    """Return a record of one check per ratio; None is a check that came to nothing, which has the ratio 0."""
    checks = [
        recorded(
            configuration="float32",
            reference="analytic",
            stage="normal",
            verdict="error" if ratio is None else verdict,
            ratio=0.0 if ratio is None else ratio,
            end_to_end=None if ratio is None else {"worst_ratio": ratio},
        )
        for ratio in ratios
    ]
    return {"name": name, "verdict": verdict, "stage": None, "item": None, "checks": checks}


def test_nothing_measured_is_no_error_of_nothing() -> None:
    assert highest(record("a/b", "error", None)) is None
    assert highest(record("a/b", "error")) is None
    assert highest(record("a/b", "error", None, 0.25)) == (0.25, "float32 analytic normal")


def test_the_worst_come_first_and_a_nan_is_the_worst() -> None:
    records = [
        record("a/pass", "pass", 0.5),
        record("a/nan", "fail", "nan"),
        record("a/fail", "fail", 3.0),
        record("a/error", "error", None),
    ]

    table = worst_first(records)

    assert list(table.columns[0].cells) == ["a/nan", "a/fail", "a/error", "a/pass"]
    assert [str(cell).split(":")[0] for cell in table.columns[5].cells] == ["over 1000", "3", "", "0.5"]


def test_a_log_says_what_takes_long_where_that_changes_and_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    page = io.StringIO()
    told = CaseProgress(Page(file=page, width=140), total=3)

    for now in range(1, 61):
        kind = "reference:analytic" if now < 32 else "judge"
        told.working(["file/large"], {kind: now if now < 32 else now - 31})

    assert page.getvalue().splitlines() == [
        "[0/3] file/large: analytic 6 s",
        "[0/3] file/large: analytic 27 s",
        "[0/3] file/large: judging 2 s",
        "[0/3] file/large: judging 23 s",
    ]


def test_a_terminal_counts_the_seconds_of_what_is_done() -> None:
    told = CaseProgress(Page(file=io.StringIO(), force_terminal=True), total=3)

    told.working(["file/large"], {"judge": 2.0, "tracer": 0.1})
    assert told._bar.tasks[0].description == "file/large: judging 2 s"
    told.working(["file/large"], {"judge": 3.0, "tracer": 1.1})
    assert told._bar.tasks[0].description == "file/large: judging 3 s, tracing 1 s"


def test_a_narrow_terminal_breaks_names_and_cuts_none() -> None:
    page, name = io.StringIO(), "integrating_sphere/from_the_centre"

    Page(file=page, width=60).print(worst_first([record(name, "fail", 3.0)]))

    assert name in "".join(line.split("│")[1].strip() for line in page.getvalue().splitlines() if "│" in line)
