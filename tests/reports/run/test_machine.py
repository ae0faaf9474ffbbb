"""What a worker of a cluster does: it compares itself with the caller, refuses, works, and returns bytes."""

import pickle
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rayproof.reports.run.engine import machine
from rayproof.reports.run.engine.machine import Batch, facts, packed, unpacked, work
from tests.reports.run.test_dispatch import OPTIONS, RECORD


def test_a_case_travels_with_its_own_files_and_no_other(tmp_path: Path) -> None:
    own = ("scenes/played/0.json", "images/played/0.js", "images/played/0/analytic.exr")
    for name in (*own, "scenes/played/1.json", "images/played/1/analytic.exr"):
        (tmp_path / "there" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "there" / name).write_bytes(name.encode())

    record = unpacked(packed("played/0", RECORD, tmp_path / "there"), tmp_path / "here")

    assert record == RECORD
    files = {path for path in (tmp_path / "here").rglob("*") if path.is_file()}
    assert {path.relative_to(tmp_path / "here").as_posix() for path in files} == {*own}
    assert all(path.read_bytes() == path.relative_to(tmp_path / "here").as_posix().encode() for path in files)


@pytest.fixture
def machines(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the runs for which processes would have been started here; the disk is full for each."""
    distributed = pytest.importorskip("distributed")
    begun: list[str] = []

    class Full:
        def __init__(self, run: str, batch: Batch) -> None:
            begun.append(run)
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(distributed, "get_worker", lambda: SimpleNamespace(address="tls://here:1"))
    monkeypatch.setattr(machine, "_Machine", Full)
    monkeypatch.setattr(machine, "end_with_parent", lambda parent: None)
    return begun


def test_a_worker_with_other_code_refuses(machines: list[str]) -> None:
    other: dict[str, Any] = {**facts(OPTIONS), "rayproof's code": "rayproof 0.1.0 another"}
    answer = work("run", other, pickle.dumps(Batch(options=OPTIONS, timeout=60.0)))

    assert answer.worker == "tls://here:1"
    assert answer.refused.startswith("rayproof's code: ")
    assert answer.refused.endswith(" there, another here")
    assert machines == []


def test_a_worker_refuses_by_its_references_and_where_it_cannot_work(machines: list[str]) -> None:
    pickled = pickle.dumps(Batch(options=OPTIONS, timeout=60.0))
    ours = facts(OPTIONS)

    assert work("run", {**ours, "reference analytic": "0"}, pickled).refused.startswith("reference analytic: ")
    assert machines == []
    assert work("run", ours, pickled).refused == "OSError: [Errno 28] No space left on device"
    assert machines == ["run"]
    assert work("run", ours, b"cut short").refused.startswith("UnpicklingError: ")
