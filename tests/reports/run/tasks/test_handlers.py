"""What workers do: the one that asks the cache tells of entries that were damaged, and does not answer from them."""

import subprocess
import sys
from pathlib import Path
from textwrap import dedent

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


@pytest.mark.process
def test_the_tracers_worker_imports_what_a_task_needs_before_there_is_one() -> None:
    # In a process of its own: here other tests have imported everything.
    script = """
        import sys
        from rayproof.reports.run.messages import TRACING
        from rayproof.reports.run.messages import TracerTask
        from rayproof.reports.run.worker_tasks import handler
        from tests.reports.judge.scenes import SCENE
        trace = handler(TRACING)
        before = set(sys.modules)
        trace(TracerTask(scene=SCENE, configuration="float32", samples=1))
        print("drjit.llvm" in before or "drjit.cuda" in before)
        print(*sorted(name for name in set(sys.modules) - before if name.startswith(("drjit", "tracer"))))
    """
    told = subprocess.run([sys.executable, "-c", dedent(script)], capture_output=True, text=True, check=True).stdout

    assert told.splitlines() == ["True", ""]
