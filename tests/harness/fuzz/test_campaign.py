"""A short campaign over every target finds nothing; and a reader that misbehaves is found.

The recorded campaign is a command, `python -m tests.harness.fuzz --inputs 1000000`. What it finds becomes a file
of a test.
"""

from pathlib import Path

import pytest

from tests.harness.fuzz import campaign
from tests.harness.fuzz.campaign import fuzz
from tests.harness.fuzz.targets import TARGETS, Target

INPUTS = {"results": 15}  # of which each takes longest


@pytest.mark.process
@pytest.mark.parametrize("name", TARGETS)
def test_nothing_is_found_in_a_short_campaign(name: str, tmp_path: Path) -> None:
    figures = fuzz(name, inputs=INPUTS.get(name, 40), seconds=60, seed=7, out=tmp_path)

    assert figures.findings == []
    assert figures.inputs > 10
    assert figures.refused + figures.taken == figures.inputs


def misbehaves(path: Path) -> None:
    content = path.read_bytes()
    if content.startswith(b"1"):
        (path.parent.parent / "stray").touch()
        (path.parent.parent / "stray").unlink()
        Path("/etc/hostname").open().close()
    if content.startswith(b"2"):
        raise KeyError("two")
    if content.startswith(b"3"):
        raise ValueError("one\ntwo")
    raise ValueError("refused")


def test_a_reader_that_misbehaves_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = Target(name="a", seeds=(b"0",), read=misbehaves, refusals=(ValueError,))
    monkeypatch.setitem(TARGETS, "bad", lambda: target)
    contents = iter((b"0", b"1", b"2", b"3"))
    monkeypatch.setattr(campaign, "mutated", lambda *_: next(contents))

    figures = fuzz("bad", inputs=4, seconds=60, seed=1, out=tmp_path)

    assert figures.inputs == 4
    assert [finding["what"].split(":")[0].split(" at ")[0] for finding in figures.findings] == [
        "it opened /etc/hostname",
        "KeyError",
        "a refusal of more than one line",
    ]
    assert [path.read_bytes() for path in sorted(tmp_path.iterdir())] == [b"1", b"2", b"3"]
