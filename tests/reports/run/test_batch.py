"""A case travels from a worker with its record and its own files."""

from pathlib import Path

from rayproof.reports.run.engine.batch import Answer, packed, unpacked
from tests.reports.run.test_dispatch import RECORD as PLAYED

RECORD = {**PLAYED, "scene": "scenes/played/0.json"}


def test_a_case_travels_with_its_own_files_and_no_other(tmp_path: Path) -> None:
    own = ("scenes/played/0.json", "images/played/0.js", "images/played/0/analytic.exr", "calls/played/0/call.txt")
    for name in (*own, "scenes/played/1.json", "images/played/1/analytic.exr"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(name.encode())

    found = unpacked(Answer(finished=(packed("played/0", RECORD, tmp_path),), seconds=1.0))

    record, files = found["played/0"]
    assert record == RECORD
    assert files == {name: name.encode() for name in own}
