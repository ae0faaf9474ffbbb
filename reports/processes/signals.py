"""SIGTERM as Ctrl-C, ending a process with its parent, and ending all descendants of a process.

CI services cancel a job by SIGTERM. A process whose parent was killed is not notified otherwise, and would run on.
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
AGAIN = 0.05  # s after which a signal whose exception was lost is sent again


class Stopping:
    """Raise KeyboardInterrupt in the body on a signal to stop, and set `told`.

    Ignored signals remain ignored, as a shell sets them for background jobs. A signal during a finalizer or a callback
    of the garbage collector, whose exceptions are lost, is sent again.
    """

    def __init__(self) -> None:
        self.told = False
        self._before: dict[signal.Signals, object] = {}
        self._hook = sys.unraisablehook
        self._last = signal.SIGINT
        self._again: threading.Timer | None = None

    def __enter__(self) -> "Stopping":
        if threading.current_thread() is threading.main_thread():  # signal handlers can only be set there
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
    """Delay the handlers of signals that arrive during the block until its end."""
    delayed: list[tuple[Any, int, Any]] = []
    before: dict[signal.Signals, Any] = {}
    if threading.current_thread() is threading.main_thread():  # handlers run only there
        before = {number: signal.getsignal(number) for number in SIGNALS}
        before = {number: handler for number, handler in before.items() if callable(handler)}
        for number, handler in before.items():
            signal.signal(number, lambda number, frame, handler=handler: delayed.append((handler, number, frame)))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for handler, number, frame in delayed:
            handler(number, frame)


@contextmanager
def deaf() -> Iterator[None]:
    """Delay signals to stop for this process, and block Ctrl-C for the processes that it starts in the block.

    Ctrl-C is sent to the whole process group, and only the main process handles it; a worker that received it while it
    loads would print a traceback. So would a worker whose parent is interrupted between starting it and sending its
    first message. Blocking the signal is not enough for that, because another thread of this process may receive it.
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
    """Have the kernel kill this process when its parent ends (Linux), and end at once if the parent has ended.

    `parent` is the parent's process id; `name`, of up to 15 bytes, is the name of this process in process listings.
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
MOST_ROUNDS = 50  # of stopping new descendants, more than any program needs that forks while it is stopped


def adopt_orphans() -> None:
    """Make this process the new parent of orphaned descendants, so that none can escape (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(SUBREAPER, 1, 0, 0, 0)


def descendants(pid: int, *, besides: frozenset[int] = frozenset()) -> list[psutil.Process]:
    """Return the living descendants of the process `pid`, except the ids in `besides`."""
    try:
        below = psutil.Process(pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []
    return [process for process in below if process.pid not in besides and _alive(process)]


def end_below(pid: int, *, besides: frozenset[int] = frozenset()) -> list[str]:
    """End all descendants of the process `pid` and return their names.

    All are stopped first, repeatedly until no new one appears: a stopped process cannot fork.
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
