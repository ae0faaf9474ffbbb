"""Being told to stop: SIGTERM, by which CI services cancel a job, ends a command as Ctrl-C does."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stopping:
    """Raise KeyboardInterrupt in the body when the process is asked to stop, and remember in `told` that it was.

    A signal that was ignored stays so, as a shell has it for what runs in the background.
    """

    def __init__(self) -> None:
        self.told = False
        self._before: dict[signal.Signals, object] = {}

    def __enter__(self) -> "Stopping":
        if threading.current_thread() is threading.main_thread():  # elsewhere signals cannot be heard
            for name in SIGNALS:
                if signal.getsignal(name) not in (signal.SIG_IGN, None):
                    self._before[name] = signal.signal(name, self._stop)
        return self

    def __exit__(self, *_: object) -> None:
        for name, before in self._before.items():
            signal.signal(name, before)  # type: ignore[arg-type]

    def _stop(self, number: int, frame: FrameType | None) -> None:
        self.told = True
        raise KeyboardInterrupt


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
