"""Leaving nothing running: whatever a program started, and whatever that started in turn, is found and ended."""

import ctypes
import sys

import psutil

SUBREAPER = 36  # PR_SET_CHILD_SUBREAPER, linux/prctl.h
MOST_ROUNDS = 50  # a program that forks faster than it is stopped ends sooner than this


def adopt_orphans() -> None:
    """Have processes whose parent has gone become this one's children, so that none can slip away (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(SUBREAPER, 1, 0, 0, 0)


def descendants(pid: int, *, besides: frozenset[int] = frozenset()) -> list[psutil.Process]:
    """Return the living processes below `pid`, without those of `besides`."""
    try:
        below = psutil.Process(pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []
    return [one for one in below if one.pid not in besides and _alive(one)]


def end_below(pid: int, *, besides: frozenset[int] = frozenset()) -> list[str]:
    """End every process below `pid` and return their names.

    All are stopped first, again and again until no new one shows up: what is stopped cannot fork.
    """
    stopped: dict[int, psutil.Process] = {}
    names: list[str] = []
    for _ in range(MOST_ROUNDS):
        new = [one for one in descendants(pid, besides=besides) if one.pid not in stopped]
        if not new:
            break
        for one in new:
            stopped[one.pid] = one
            try:
                names.append(one.name())
                one.suspend()
            except psutil.NoSuchProcess:
                continue
    for one in stopped.values():
        try:
            one.kill()
        except psutil.NoSuchProcess:
            continue
    psutil.wait_procs(list(stopped.values()), timeout=5)
    return names


def _alive(process: psutil.Process) -> bool:
    try:
        return process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
