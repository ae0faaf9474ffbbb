"""Limits as files, tables, bars and gates."""

import csv
from pathlib import Path

import pytest
from msgspec.structs import replace

from rayproof.reports.publish.page import plots
from rayproof.reports.studies.stability.limit_records import (
    LimitRecord,
    LimitsRecord,
    ScaleRecord,
    changes,
    load_limits,
    worse,
    write_limits,
)


def limit(renderer: str, reached: float | None, breaks_at: float | None) -> LimitRecord:
    return LimitRecord(
        renderer=renderer,
        ladder="offset",
        limit=reached,
        breaks_at=breaks_at,
        verdict="pass" if breaks_at is None else "fail",
        stage="" if breaks_at is None else "normal",
        items=[] if breaks_at is None else ["XF-1", "XF-2", "NRM-1", "NRM-3"],
        reason="",
        monotone=True,
        rungs=[],
    )


DOCUMENT = LimitsRecord(
    schema=1,
    subject="mine",
    renderers=["mine", "radiance"],
    ladders=[
        ScaleRecord(ladder="offset", quantity="Offset", unit="m", values=[1.0, 10.0, 100.0, 1000.0], control=True)
    ],
    limits=[limit("mine", 10.0, 100.0), limit("radiance", 1000.0, None)],
    environment={},
)


def with_limit(reached: float | None) -> LimitsRecord:
    first, *others = DOCUMENT.limits
    return replace(DOCUMENT, limits=[replace(first, limit=reached), *others])


def test_files_are_read_again_and_drawn_on_a_logarithmic_axis(tmp_path: Path) -> None:
    write_limits(tmp_path / "stability", DOCUMENT)
    first = next(csv.DictReader((tmp_path / "stability" / "limits.csv").read_text().splitlines()))
    drawn = plots.limits(tmp_path)

    assert load_limits(tmp_path) == DOCUMENT
    assert (first["renderer"], first["limit"], first["items"]) == ("mine", "10.0", "XF-1 XF-2 NRM-1 NRM-3")
    assert drawn is not None
    assert [bar["share"] for bar in drawn["bars"]] == [pytest.approx(1 / 3, abs=1e-4), 1.0]


@pytest.mark.parametrize(("after", "rungs", "lower"), [(1.0, -1, 1), (10.0, 0, 0), (1000.0, 2, 0), (None, -2, 1)])
def test_two_are_compared_by_rungs(after: float | None, rungs: int, lower: int) -> None:
    found = changes(DOCUMENT, with_limit(after))

    assert [one.rungs for one in found] == [rungs]
    assert len(worse(found)) == lower


def test_a_limit_below_the_first_rung_is_never_right() -> None:
    assert worse(changes(DOCUMENT, with_limit(None))) == ["offset, right up to [m]: 10 before, never right now"]


def test_a_ladder_that_is_missing_counts_as_lost() -> None:
    other = replace(DOCUMENT, ladders=[], limits=[])

    assert changes(DOCUMENT, other)[0].rungs == -2
