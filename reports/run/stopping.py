"""Being told to stop: SIGTERM, by which CI services cancel a job, ends a command as Ctrl-C does."""

import signal
import threading
from types import FrameType

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
