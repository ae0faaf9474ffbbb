"""A formula of one's own beside the default of its slot: a line for each ladder, and the ladders that differ most."""

from typing import Any

import pytest

from rayproof.reports.studies.stability.beside_default import beside_rows, signs_of
from rayproof.reports.studies.stability.records import ClimbRecord, Rung
from rayproof.tracer.formulas import FORMULAS

DEFAULT = FORMULAS.variants("sphere")[0].name
OWN = "sphere=./mine.py:hit"


def climb(
    formula: str, *, ladder: str = "A", breakpoint: float | None = 3.0, wrong: int = 0, error: float = 1.0
) -> ClimbRecord:
    """Return the record of a climb of three values."""
    steps = tuple(
        Rung(value=value, rays=100, median=error, false_hits=0, false_misses=0, invalid=0) for value in (1.0, 2.0, 3.0)
    )
    return ClimbRecord(
        ladder=ladder, formula=formula, precision="float32", slope=None, slope_interval=None, slope_predicted=None,
        breakpoint=breakpoint, scaled_error=error, false_hits=wrong, false_misses=0, invalid=0, rays=300,
        per_million={}, expected="none", verdict="pass", reasons=(),
        known="", surprise="", values=steps,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("own", "signs", "word"),
    [
        ({}, (0, 0, 0), "alike"),
        ({"error": 3.9}, (0, 0, 0), "alike"),  # as small as a backward stable formula's
        ({"error": 50.0}, (0, 0, -1), "worse"),
        ({"breakpoint": None}, (-1, 0, 0), "worse"),
        ({"breakpoint": 1.0, "wrong": 0, "error": 1.0}, (-1, 0, 0), "worse"),
        ({"wrong": 9, "breakpoint": 3.0}, (0, -1, 0), "worse"),
    ],
)
def test_what_is_compared(own: dict[str, Any], signs: tuple[int, int, int], word: str) -> None:
    records = [climb(DEFAULT), climb(OWN, **own)]

    assert signs_of(records[1], records[0]) == signs
    ((ladder, *_, said),) = beside_rows(records, ["float32"])
    assert (ladder, said) == ("A", word)


def test_a_formula_that_is_better_in_one_way_and_worse_in_another_is_mixed() -> None:
    records = [climb(DEFAULT, breakpoint=1.0), climb(OWN, breakpoint=3.0, error=99.0)]

    assert beside_rows(records, ["float32"])[0] == ["A", "3 (1)", "99 (1)", "mixed"]
