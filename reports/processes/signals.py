"""Being told to stop: SIGTERM, by which CI services cancel a job, ends a command as Ctrl-C does."""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

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
    """Put off being told to stop, for this process, and Ctrl-C for what it starts meanwhile.

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
