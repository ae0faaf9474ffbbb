"""Guards that let a harness pass: the same code on the same packages and processor would be let pass again."""

from collections.abc import Callable
from dataclasses import dataclass

from rayproof.reports.cache.digests import Key, code, machine
from rayproof.reports.cache.entries import DamagedEntryError
from rayproof.reports.cache.store import Store

# What asks the guards, the guards themselves and with them all that they guard.
CODE = (
    "rayproof.reports.run.guards",
    "rayproof.reports.judge.self_test.stand_guard",
    "rayproof.reports.run.tasks.judge_task",
    "rayproof.reports.run.suite",
)


@dataclass(frozen=True, kw_only=True)
class GuardKey(Key):
    """That a guard passed."""

    name: str


def ask_once(name: str, guard: Callable[[], object], store: Store) -> None:
    """Ask a guard that never passed this code, or not here; raise what it raises. Only that it passed is kept."""
    if passed(name, store):
        return
    guard()
    try:
        store.put(_key(name), {"kind": "guard", "reference": name}, {})
    except OSError:
        return  # it is asked again next time


def passed(name: str, store: Store) -> bool:
    """Say whether a guard passed this code here before."""
    try:
        return store.get(_key(name)) is not None
    except DamagedEntryError:
        return False  # it is gone, and the guard is asked


def _key(name: str) -> str:
    return GuardKey(name=name, code=code(CODE), machine=machine()).digest
