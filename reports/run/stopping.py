"""Being told to stop: SIGTERM, by which CI services cancel a job, ends a run as Ctrl-C does."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Raise KeyboardInterrupt in the body when the process is asked to terminate."""
    if threading.current_thread() is not threading.main_thread():
        yield  # where signals cannot be heard
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
