"""One worker's process: started with a channel and a folder for temporary files, ended with all that it started itself.

It ends with its parent, too, however that ends, and is shown as `rayproof-` and its kind in listings of processes.
"""

import multiprocessing
import os
import signal
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.process import BaseProcess
from typing import Any

from reports.parent_death import end_with_parent
from reports.run.channel import Channel, channels
from reports.run.scratch import Scratch
from reports.run.stopping import put_off

# A fork would share the JIT compilers' state and threads.
CONTEXT = multiprocessing.get_context("spawn")
PARTING = 5.0  # s for a process whose channel has closed, or that was killed, to be gone


@dataclass(frozen=True, kw_only=True)
class WorkerProcess:
    """A process that serves one kind of task, and our end of its channel."""

    process: BaseProcess
    connection: Channel
    scratch: Scratch

    @property
    def alive(self) -> bool:
        """Say whether it still runs."""
        return self.process.is_alive()

    def how_it_ended(self) -> str:
        """Return in words how a process ended that closed its channel."""
        self.process.join(timeout=PARTING)
        code = self.process.exitcode
        if code is not None and code < 0:
            try:
                return f"signal {signal.Signals(-code).name}"
            except ValueError:
                return f"signal {-code}"
        return f"exit code {code}"

    def end(self) -> None:
        """End it with all that it started: a program under test does not outlive the run that called it."""
        self.connection.close()
        if self.process.pid is not None and self.process.is_alive():
            from reports.subjects.orphans import end_below

            end_below(self.process.pid)
        self.process.kill()

    def clean_up(self) -> None:
        """Wait until it is gone, though not for what a killed process may still wait for, and remove what it left."""
        self.process.join(timeout=PARTING)
        self.scratch.remove()


def started(kind: str, target: Callable[[str, Any], None]) -> WorkerProcess:
    """Return a new process in which `target` serves tasks of `kind`."""
    scratch = Scratch()
    try:
        ours, theirs = channels()
        given = (target, str(scratch.folder), kind, theirs, os.getpid())
        process = CONTEXT.Process(target=_work_in, args=given, daemon=True, name=f"rayproof-{kind}")
        # Or this would start with the first worker, and hear again what is not to be heard.
        resource_tracker.ensure_running()
        with _deaf():
            process.start()
        theirs.close()
    except BaseException:
        scratch.remove()
        raise
    return WorkerProcess(process=process, connection=ours, scratch=scratch)


@contextmanager
def _deaf() -> Iterator[None]:
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


def _work_in(target: Callable[[str, Any], None], folder: str, kind: str, connection: Channel, parent: int) -> None:
    """Serve as a worker whose temporary files are made in `folder`: one that is killed cannot remove them itself."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # what it starts may hear it
    end_with_parent(parent, f"rayproof-{kind}")
    tempfile.tempdir = folder
    target(kind, connection)
