"""The campaign shrinks what it draws, goes on where it stopped, and says what is not as promised."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from tests.command_line import Command
from tests.harness.audit.diagnosing import compiler
from tests.harness.shrinking.__main__ import shrinking
from tests.harness.shrinking.campaign import ALONE, PROGRAMS, STAGED, TRACER, Found, Shrunk

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C++ compiler")


@pytest.mark.process
def test_a_fault_and_a_switch_are_shrunk_once(command: Command, tmp_path: Path) -> None:
    once = command(shrinking, "--out", tmp_path, "--only", "*no_pi", "--count", 0, "--tries", 60)
    lines = (tmp_path / "shrunk.jsonl").read_text()
    again = command(shrinking, "--out", tmp_path, "--only", "*no_pi", "--count", 0, "--tries", 60)

    assert once.code == again.code == 0, once.out + once.error
    found = [json.loads(line) for line in lines.splitlines()]
    assert {(one["kind"], one["written"]) for one in found} == {
        (kind, written) for kind in (TRACER, PROGRAMS) for written in (STAGED, ALONE)
    }
    assert all(one["right_passes"] and one["own_kept"] and one["after"] == [1, 1, 1] for one in found)
    assert (tmp_path / "shrunk.jsonl").read_text() == lines
    assert "| all |  | 4 | 1, 1 | 1, 1 | 1, 1 |" in (tmp_path / "table.md").read_text()


GOOD = Shrunk(
    name="a", kind=TRACER, written=STAGED, case="b/c", after=(1, 1, 1), items_before=("HIT-1",), items_after=("HIT-1",)
)


@pytest.mark.parametrize(
    ("worse", "problem"),
    [
        (replace(GOOD, after=(3, 1, 1)), "3 shapes at 50 %"),
        (replace(GOOD, after=(1, 1, 4)), "4 pixels at 50 %"),
        (replace(GOOD, tries=201), "201 renders"),
        (replace(GOOD, processor=21.0), "21 s of processor time"),
        (replace(GOOD, right_passes=False), "without its fault it fails"),
        (replace(GOOD, items_after=("HIT-3",)), "0% of the small scenes"),
        (replace(GOOD, own_kept=False), "0% of the small scenes"),
    ],
)
def test_what_is_not_as_promised_is_said(worse: Shrunk, problem: str) -> None:
    assert Found((GOOD,)).problems() == []
    assert [problem in line for line in Found((worse,)).problems()].count(True) == 1


def test_nothing_shrunk_is_a_problem() -> None:
    assert Found((replace(GOOD, case=""),)).problems() == ["nothing was shrunk"]
