"""What workers do: the one that asks the cache tells of entries that were damaged, and does not answer from them."""

from pathlib import Path

import pytest

from rayproof.reports.run import reference_cache
from rayproof.reports.run.cache_store import Store
from rayproof.reports.run.options import CaseOptions
from rayproof.reports.run.worker_tasks import ask_reference, cached_references
from tests.reports.judge.scenes import CASE, ORACLE


def test_a_damaged_entry_is_told_of_by_the_one_who_met_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAYPROOF_CACHE", str(tmp_path))
    monkeypatch.setattr(reference_cache, "OPENING", -1.0)
    monkeypatch.setattr(reference_cache, "READING", 1e18)
    options = CaseOptions(references=("analytic",))
    ask_reference("analytic", ORACLE, CASE.scene, samples=CASE.samples, cached=True, independent=True)
    assert set(cached_references(CASE, options)[0]) == {"analytic"}
    for item in Store(tmp_path).items():
        item.path.write_bytes(item.path.read_bytes()[:-1])

    found, damaged = cached_references(CASE, options)

    assert found == {}
    assert "was damaged" in damaged["analytic"]
