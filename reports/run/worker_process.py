"""One worker's process: started with a pipe and a folder for temporary files, ended with all that it started itself."""

import multiprocessing
import signal
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from typing import Any

# A fork would share the JIT compilers' state and threads.
CONTEXT = multiprocessing.get_context("spawn")
PARTING = 5.0  # s for a process whose pipe has closed to be gone


@dataclass(frozen=True, kw_only=True)
class WorkerProcess:
    """A process that serves one kind of task, and our end of its pipe."""

    process: BaseProcess
    connection: Any  # multiprocessing's Connection; on Windows its PipeConnection
    folder: tempfile.TemporaryDirectory[str]

    @property
    def alive(self) -> bool:
        """Say whether it still runs."""
        return self.process.is_alive()

    def how_it_ended(self) -> str:
        """Return in words how a process ended that closed its pipe."""
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
        """Wait until it is gone, and remove what it left."""
        self.process.join()
        self.folder.cleanup()


def started(kind: str, target: Callable[[str, Any], None]) -> WorkerProcess:
    """Return a new process in which `target` serves tasks of `kind`."""
    ours, theirs = CONTEXT.Pipe()
    folder = tempfile.TemporaryDirectory(prefix="rayproof-", ignore_cleanup_errors=True)
    given = (target, folder.name, kind, theirs)
    process = CONTEXT.Process(target=_work_in, args=given, daemon=True, name=f"rayproof-{kind}")
    process.start()
    theirs.close()
    return WorkerProcess(process=process, connection=ours, folder=folder)


def _work_in(target: Callable[[str, Any], None], folder: str, kind: str, connection: Any) -> None:
    """Serve as a worker whose temporary files are made in `folder`: one that is killed cannot remove them itself."""
    tempfile.tempdir = folder
    target(kind, connection)
