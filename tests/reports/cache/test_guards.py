"""A guard is asked once for one state of the code, and again whenever it did not pass."""

from pathlib import Path

import pytest

from rayproof import ROOT
from rayproof.reports.cache import guards
from rayproof.reports.cache.closure import closure
from rayproof.reports.cache.guards import ask_once
from rayproof.reports.cache.store import Store


def test_a_guard_that_passed_is_not_asked_again_until_the_code_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    store = Store(tmp_path)

    for _ in range(2):
        ask_once("one", lambda: asked.append(1), store)
    ask_once("another", lambda: asked.append(2), store)
    monkeypatch.setattr(guards, "code", lambda modules: "other code")
    ask_once("one", lambda: asked.append(3), store)

    assert asked == [1, 2, 3]


def test_a_guard_that_cries_is_asked_every_time(tmp_path: Path) -> None:
    asked: list[int] = []

    def cry() -> None:
        asked.append(1)
        raise RuntimeError("broken")

    for _ in range(2):
        with pytest.raises(RuntimeError, match="broken"):
            ask_once("one", cry, Store(tmp_path))

    assert asked == [1, 1]


def test_a_store_that_cannot_be_written_costs_only_time(tmp_path: Path) -> None:
    asked: list[int] = []
    (tmp_path / "file").write_text("not a folder")

    for _ in range(2):
        ask_once("one", lambda: asked.append(1), Store(tmp_path / "file"))

    assert asked == [1, 1]


def test_what_the_guards_guard_is_part_of_their_key() -> None:
    guarded = {path.relative_to(ROOT).as_posix() for path in closure(guards.CODE)}

    assert {"reports/judge/tolerance/limits.py", "cases/mesh_files.py", "reports/run/record/totals.py"} <= guarded
    assert {"reports/run/guards/loader.py", "reference/analytic/light.py", "reports/cache/store.py"} <= guarded
