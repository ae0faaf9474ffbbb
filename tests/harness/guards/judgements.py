"""The memory's guard: a verdict is found again as it was kept, under exactly its own key, and unaltered."""

import tempfile
from pathlib import Path

from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.run import verdict_memory
from rayproof.reports.run.cache_store import Store
from tests.harness.guards import BrokenHarnessError

_SCENE = "scenes/guard.json"
_RECORD: CaseRecord = {
    "name": "guard/judgements",
    "family": "guard",
    "verdict": "fail",
    "scene": _SCENE,
    "renders": [],
    "checks": [],
    "shapes": [],
    "lights": 0,
    "width": 4,
    "height": 3,
    "judge_seconds": 1.0,
}


def guard_judgements() -> None:
    """Keep a verdict and ask for it by its key and by another; raise BrokenHarnessError where the answer is wrong."""
    with tempfile.TemporaryDirectory() as folder:
        _guard_entries(Path(folder), "0" * 64, "1" * 64)


def _guard_entries(folder: Path, known: str, other: str) -> None:
    """Keep one verdict and ask for it by its key, by another one, and when it was altered."""
    (folder / "scenes").mkdir()
    (folder / _SCENE).write_text("{}")
    store = Store(folder / "cache")
    verdict_memory.keep(store, known, folder, _RECORD)
    found = verdict_memory.recall(store, known)
    if found is None or found.record != _RECORD or found.files != {_SCENE: b"{}"}:
        raise BrokenHarnessError("the memory is broken: a verdict was not found as it was kept")
    if verdict_memory.recall(store, other) is not None:
        raise BrokenHarnessError("the memory is broken: a verdict was found for other answers")
    for item in store.items():
        data = bytearray(item.path.read_bytes())
        data[-1] ^= 1
        item.path.write_bytes(bytes(data))
    if verdict_memory.recall(store, known) is not None:
        raise BrokenHarnessError("the memory is broken: an altered verdict was believed")
