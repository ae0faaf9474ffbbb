"""SIGTERM as Ctrl-C, ending with one's parent, and ending every process below another.

CI services cancel a job by SIGTERM. A process whose parent was killed gets no other word of it, and would run on.
"""

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import psutil

SIGNALS = (signal.SIGINT, signal.SIGTERM)
AGAIN = 0.05  # s after which a signal that nobody heard is sent again


class Stopping:
    """Raise KeyboardInterrupt in the body when the process is asked to stop, and remember in `told` that it was.

    A signal that was ignored stays so, as a shell has it for what runs in the background. One that comes while a
    finalizer or a callback of the garbage collector runs, above which nobody hears what it raises, comes again.
    """

    def __init__(self) -> None:
        self.told = False
        self._before: dict[signal.Signals, object] = {}
        self._hook = sys.unraisablehook
        self._last = signal.SIGINT
        self._again: threading.Timer | None = None

    def __enter__(self) -> "Stopping":
        if threading.current_thread() is threading.main_thread():  # elsewhere signals cannot be heard
            for name in SIGNALS:
                if signal.getsignal(name) not in (signal.SIG_IGN, None):
                    self._before[name] = signal.signal(name, self._stop)
            self._hook, sys.unraisablehook = sys.unraisablehook, self._unheard
        return self

    def __exit__(self, *_: object) -> None:
        if sys.unraisablehook == self._unheard:
            sys.unraisablehook = self._hook
        if self._again is not None:
            self._again.cancel()
        for name, before in self._before.items():
            signal.signal(name, before)  # type: ignore[arg-type]

    def _stop(self, number: int, frame: FrameType | None) -> None:
        self.told, self._last = True, signal.Signals(number)
        raise KeyboardInterrupt

    def _unheard(self, what: "sys.UnraisableHookArgs") -> None:
        if not (self.told and isinstance(what.exc_value, KeyboardInterrupt)):
            self._hook(what)
            return
        self._again = threading.Timer(AGAIN, os.kill, (os.getpid(), self._last))
        self._again.daemon = True
        self._again.start()


@contextmanager
def put_off() -> Iterator[None]:
    """Call the handlers of the signals that came during the block only after it."""
    heard: list[tuple[Any, int, Any]] = []
    before: dict[signal.Signals, Any] = {}
    if threading.current_thread() is threading.main_thread():  # handlers run in no other
        before = {number: signal.getsignal(number) for number in SIGNALS}
        before = {number: handler for number, handler in before.items() if callable(handler)}
        for number, handler in before.items():
            signal.signal(number, lambda number, frame, handler=handler: heard.append((handler, number, frame)))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for handler, number, frame in heard:
            handler(number, frame)


@contextmanager
def deaf() -> Iterator[None]:
    """Put off signals to stop, for this process, and Ctrl-C for the processes that it starts meanwhile.

    Ctrl-C goes to the whole process group, and only the main process decides what it means; a worker that heard it
    while it loads would print what it was about. So would one whose parent gave up between starting it and telling it
    what to do. A blocked signal alone does not prevent that, because another thread may still take it.
    """
    with put_off():
        if not hasattr(signal, "pthread_sigmask"):
            yield
            return
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


PDEATHSIG, NAME = 1, 15  # PR_SET_PDEATHSIG and PR_SET_NAME, linux/prctl.h


def end_with_parent(parent: int, name: str = "") -> None:
    """Have the kernel kill this process when its parent ends (Linux), and end at once if that was before.

    `parent` is the parent's process number; `name`, of up to 15 bytes, is how process listings show this one.
    """
    if sys.platform != "linux":
        return
    prctl = ctypes.CDLL(None, use_errno=True).prctl
    prctl(PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if name:
        prctl(NAME, name.encode(), 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)


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
        new = [process for process in descendants(pid, besides=besides) if process.pid not in stopped]
        if not new:
            break
        for process in new:
            stopped[process.pid] = process
            try:
                names.append(process.name())
                process.suspend()
            except psutil.NoSuchProcess:
                continue
    for process in stopped.values():
        try:
            process.kill()
        except psutil.NoSuchProcess:
            continue
    psutil.wait_procs(list(stopped.values()), timeout=5)
    return names


def _alive(process: psutil.Process) -> bool:
    try:
        return process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
