"""What workers do: the one that asks the cache tells of entries that were damaged, and does not answer from them."""

from pathlib import Path

import pytest

from rayproof.reports.run import reference_cache
from rayproof.reports.run.cache_store import Store
from rayproof.reports.run.messages import RECALLING, RecallTask, ReferenceTask
from rayproof.reports.run.worker_tasks import ask_reference, handler
from tests.reports.judge.scenes import ORACLE, SCENE


def test_a_damaged_entry_is_told_of_by_the_one_who_met_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAYPROOF_CACHE", str(tmp_path))
    monkeypatch.setattr(reference_cache, "OPENING", -1.0)
    monkeypatch.setattr(reference_cache, "READING", 1e18)
    task = ReferenceTask(scene=SCENE, samples=1, cached=True)
    ask_reference("analytic", ORACLE, task, independent=True)
    recall = handler(RECALLING)
    assert set(recall(RecallTask(names=("analytic",), task=task))[0]) == {"analytic"}
    for item in Store(tmp_path).items():
        item.path.write_bytes(item.path.read_bytes()[:-1])

    found, damaged = recall(RecallTask(names=("analytic",), task=task))

    assert found == {}
    assert "was damaged" in damaged["analytic"]
