"""The table at the end of a run: the worst first, and no error where none was measured."""

from typing import Any

from rayproof.reports.run.progress import highest, worst_first
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
