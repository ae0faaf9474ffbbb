"""The quick survey brings no surprise, and the design's headline figures are met by it."""

import pytest

from rayproof.reports.studies.stability.records import ClimbRecord
from rayproof.reports.studies.stability.survey import plan, survey

Records = dict[tuple[str, str, str], ClimbRecord]


@pytest.fixture(scope="module")
def doubts() -> list[str]:
    return []


@pytest.fixture(scope="module")
def records(doubts: list[str]) -> Records:
    """Return every climb of `rayproof stability --quick`."""
    planned = plan((), ladders=(), precisions=("float32", "float64"), quick=True)
    found = survey(planned, doubts=doubts.append)
    return {(one.ladder, one.formula, one.precision): one for one in found}


def test_nothing_is_surprising(records: Records, doubts: list[str]) -> None:
    assert [(key, one.surprise) for key, one in records.items() if one.surprise] == []
    assert doubts == []


def test_every_ladder_is_climbed_in_both_precisions(records: Records) -> None:
    assert len({ladder for ladder, _, _ in records}) >= 50
    assert {precision for _, _, precision in records} == {"float32", "float64"}


def test_the_multiplied_matrix_dies_between_ten_and_a_hundred_million(records: Records) -> None:
    found = records["CAM-RATIO", "ray/matrix_w_divide", "float32"]

    assert found.breakpoint == 1e7
    assert [rung.invalid == rung.rays for rung in found.values] == [False] * 7 + [True] * 3
