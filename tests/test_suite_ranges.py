"""The suite's ranges: docs/specification.md has them, and none becomes smaller."""

from dataclasses import replace

import pytest

from rayproof.cases.families import all_cases
from tests.suite_ranges import PAGE, QUANTITIES, Range, ranges, shrunk, table, written


@pytest.fixture(scope="module")
def now() -> list[Range]:
    return ranges(all_cases())


def test_no_range_is_smaller_than_the_specification_says(now: list[Range]) -> None:
    assert shrunk(written(PAGE.read_text(encoding="utf-8")), now) == []


def test_the_table_in_the_specification_is_up_to_date(now: list[Range]) -> None:
    before = written(PAGE.read_text(encoding="utf-8"))
    names = [(row.name, row.low_case, row.high_case) for row in now]

    assert shrunk(now, before) == [], "write it anew: .venv/bin/python -m tests.suite_ranges"
    assert [(row.name, row.low_case, row.high_case) for row in before] == names
    assert [row.name for row in before] == [*QUANTITIES]


def test_a_case_that_is_left_out_is_named(now: list[Range]) -> None:
    names = ("lights", "shapes", "width [px]", "albedo")
    left_out = {"extremes/many_lights", "extremes/very_wide_and_dim"}
    few = [case for case in all_cases() if case.name not in left_out]

    assert shrunk([row for row in now if row.name in names], ranges(few, names)) == [
        "lights: the largest value was 17 (extremes/many_lights), and is 8",
        "width [px]: the largest value was 1063 (extremes/very_wide_and_dim), and is 265",
    ]
    assert shrunk(now[:1], []) == ["lights: the table has it, and nothing computes it any more"]
    # A smallest value that grows is a smaller range as well.
    assert "the smallest value was 0 " in shrunk(now[:1], [replace(now[0], low=1)])[0]


def test_what_is_written_is_read(now: list[Range]) -> None:
    read = written(f"<!-- made by tests.suite_ranges -->\n\n{table(now)}\n<!-- end -->\n")

    assert shrunk(read, now) == shrunk(now, read) == []
