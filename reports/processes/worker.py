"""A worker process: serves one renderer, or the judge, and answers one task after another.

JIT compilers abort, Mitsuba's variant is global state and a stranger's renderer may do anything, so each renderer
has a process of its own. A task that raises is answered with the exception's line; a process that dies is noticed by
the pool, which replaces it.
"""

import contextlib
import os
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from rayproof.reports.processes.channel import Channel

PREPARE = None  # instead of a task: import what the first one will need; nothing is answered


@dataclass(frozen=True, kw_only=True)
class Reply:
    """What a worker sends back: a value, or the error it met and where."""

    value: Any
    error: str | None
    trace: str | None
    seconds: float
    stopped: bool = False  # by a time limit, and not by anything that went wrong
    computed: float | None = None  # s of processor time that it took, its programs' included; None: nobody knows


def _processor_time() -> float:
    """Return what this process and the programs that it has called took so far [s]."""
    return sum(os.times()[:4])


def serve(kind: str, connection: Channel, handlers: Callable[[str], Callable[[Any], Any]]) -> None:
    """Answer tasks until the other end closes; `handlers` returns the function that does tasks of `kind`."""
    handler: Callable[[Any], Any] | None = None
    while True:
        try:
            task = connection.recv()
        except (EOFError, OSError):
            return
        start, before = time.perf_counter(), _processor_time()
        if task is PREPARE:
            with contextlib.suppress(Exception):  # the first task meets it too, and answers with it
                handler = handlers(kind)
            continue
        try:
            handler = handler or handlers(kind)
            reply = Reply(value=handler(task), error=None, trace=None, seconds=time.perf_counter() - start)
        except Exception as error:  # the boundary: whatever a renderer raises is that task's error
            line = f"{type(error).__name__}: {error}".splitlines()[0]
            reply = Reply(value=None, error=line, trace=traceback.format_exc(), seconds=time.perf_counter() - start)
        try:
            connection.send(replace(reply, computed=_processor_time() - before))
        except OSError:
            return
