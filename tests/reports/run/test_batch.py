"""What a worker sends back is checked as foreign data: whose records, which files, what form."""

import json
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.run.engine.batch import Answer, BadAnswerError, Batch, Finished, packed, unpacked
from tests.reports.run.test_dispatch import LIMITS, TERMS, planned
from tests.reports.run.test_dispatch import RECORD as PLAYED

RECORD = {**PLAYED, "scene": "scenes/played/0.json"}
BATCH = Batch(name="a", run="b", terms=TERMS, limits=LIMITS, cases=(planned(0),))
GOOD = Finished(
    name="played/0", record=zlib.compress(json.dumps(RECORD).encode()), files={"scenes/played/0.json": b"{}"}
)


def test_a_case_travels_with_its_own_files_and_no_other(tmp_path: Path) -> None:
    own = ("scenes/played/0.json", "images/played/0.js", "images/played/0/analytic.exr", "calls/played/0/call.txt")
    for name in (*own, "scenes/played/1.json", "images/played/1/analytic.exr"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(name.encode())

    found = unpacked(Answer(finished=(packed("played/0", RECORD, tmp_path),), seconds=1.0), BATCH)

    record, files = found["played/0"]
    assert record == RECORD
    assert files == {name: name.encode() for name in own}


@pytest.mark.parametrize(
    "name",
    [
        "../scenes/played/0.json", "/etc/passwd", "scenes/../../x", "scenes/played/1.json", "images/played/1/a.exr",
        "index.html", "images/played/0/../1.js", "images/played/0/./a.exr", "scenes/played/0.json/", "scenes",
    ],
)  # fmt: skip
def test_a_file_elsewhere_than_the_case_s_is_refused(name: str) -> None:
    wrong = replace(GOOD, files={**GOOD.files, name: b""})

    with pytest.raises(BadAnswerError, match="no file of played/0"):
        unpacked(Answer(finished=(wrong,), seconds=1.0), BATCH)


def record(**changes: Any) -> Finished:
    return replace(GOOD, record=zlib.compress(json.dumps({**RECORD, **changes}).encode()))


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        ("a text", "answered with str"),
        (Answer(finished=(), seconds=1.0), "answered others"),
        (Answer(finished=(GOOD, GOOD), seconds=1.0), "answered others"),
        (Answer(finished=(replace(GOOD, name="played/1"),), seconds=1.0), "answered others"),
        (Answer(finished=(record(name="played/1"),), seconds=1.0), "another case"),
        (Answer(finished=(record(verdict="splendid"),), seconds=1.0), "verdict"),
        (Answer(finished=(record(planned=1),), seconds=1.0), "planned 1 but 0"),
        (Answer(finished=GOOD, seconds=1.0), "other types"),
        (Answer(finished=(replace(GOOD, files={"scenes/played/0.json": "text"}),), seconds=1.0), "other types"),
        (Answer(finished=(GOOD,), seconds=float("nan")), "other types"),
        (Answer(finished=(record(pixels="images/played/0.js"),), seconds=1.0), "did not come with it"),
        (Answer(finished=(replace(GOOD, record=GOOD.record[:-9]),), seconds=1.0), "cut short"),
        (Answer(finished=(replace(GOOD, record=b"no zlib"),), seconds=1.0), "record of played/0"),
    ],
)
def test_a_record_that_was_not_asked_for_or_is_none_is_refused(answer: Any, says: str) -> None:
    with pytest.raises(BadAnswerError, match=says):
        unpacked(answer, BATCH)
