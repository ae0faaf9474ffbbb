"""One worker's process: started with a channel and a folder for temporary files, ended with all that it started itself.

It is a new interpreter that imports `rayproof` and nothing of the script that called it: `multiprocessing` would run an
unguarded script a second time, and refuses to start anything below a process of its own. It ends with its parent, too,
however that ends, and is shown as `rayproof-` and its kind in listings of processes.

What libraries print in it goes to an unnamed file and not to the terminal, of which the last line is told where the
process fails: compilers of renderers speak of their caches there, and an interpreter without memory of itself.
"""

import contextlib
import importlib
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from rayproof import HOLDER
from rayproof.reports.processes.channel import Channel, channels
from rayproof.reports.processes.parent_death import end_with_parent
from rayproof.reports.processes.scratch import Scratch
from rayproof.reports.processes.signals import deaf

START = (
    "import sys; sys.path.insert(0, sys.argv[1]); "
    "from rayproof.reports.processes.worker_process import begin; begin(*map(int, sys.argv[2:]))"
)
PARTING = 5.0  # s for a process whose channel has closed, or that was killed, to be gone
LAST = 1000  # bytes of what it printed in which its last line is looked for


@dataclass(frozen=True, kw_only=True)
class WorkerProcess:
    """A process that serves one kind of task, and our end of its channel."""

    process: subprocess.Popen[bytes]
    connection: Channel
    scratch: Scratch
    printed: IO[bytes]  # what it printed, be it to standard output or error

    @property
    def alive(self) -> bool:
        """Say whether it still runs."""
        return self.process.poll() is None

    @property
    def memory(self) -> int:
        """Return how much of the machine's memory it has [bytes]; 0 where it has gone."""
        import psutil

        try:
            return psutil.Process(self.process.pid).memory_info().rss
        except psutil.Error:
            return 0

    def how_it_ended(self) -> str:
        """Return in words how a process ended that closed its channel."""
        self._wait()
        code = self.process.returncode
        if code is None:
            return "it closed its channel and runs on"
        if code < 0:
            try:
                return f"signal {signal.Signals(-code).name}"
            except ValueError:
                return f"signal {-code}"
        said = self._last_line() if code else ""
        return f"exit code {code}: {said}" if said else f"exit code {code}"

    def _last_line(self) -> str:
        self.printed.seek(0, os.SEEK_END)
        self.printed.seek(max(0, self.printed.tell() - LAST))
        lines = self.printed.read().decode(errors="replace").split("\n")
        last = next((line for line in reversed(lines) if line.strip()), "")
        return "".join(letter for letter in last.strip() if letter.isprintable())

    def end(self) -> None:
        """End it with all that it started: a program under test does not outlive the run that called it."""
        self.connection.close()
        if self.alive:
            from rayproof.reports.processes.process_tree import end_below

            end_below(self.process.pid)
        self.process.kill()

    def clean_up(self) -> None:
        """Wait until it is gone, though not for what a killed process may still wait for, and remove what it left."""
        self._wait()
        self.printed.close()
        self.scratch.remove()

    def _wait(self) -> None:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(timeout=PARTING)


@dataclass(frozen=True, kw_only=True)
class _Beginning:
    """What a new process is told first of all."""

    module: str  # in which the function is that serves
    function: str
    kind: str
    folder: str  # for temporary files
    path: tuple[str, ...]  # where modules are looked for


def started(kind: str, target: Callable[[str, Any], None], within: Path | None = None) -> WorkerProcess:
    """Return a new process in which `target`, a function at the top of its module, serves tasks of `kind`.

    Its folder for temporary files is made in `within`, or where this process has its own.
    """
    scratch = Scratch(within)
    try:
        ours, theirs = channels()
        printed = tempfile.TemporaryFile(dir=scratch.folder)  # noqa: SIM115  closed by `clean_up`
        with deaf():
            process = subprocess.Popen(
                [sys.executable, "-c", START, str(HOLDER), str(theirs.fileno()), str(os.getpid())],
                stdin=subprocess.DEVNULL,
                stdout=printed,
                stderr=printed,
                pass_fds=[theirs.fileno()],
            )
        theirs.close()
        ours.post(
            _Beginning(
                module=target.__module__,
                function=target.__qualname__,
                kind=kind,
                folder=str(scratch.folder),
                path=tuple(entry or str(Path.cwd()) for entry in sys.path),
            )
        )
    except BaseException:
        scratch.remove()
        raise
    return WorkerProcess(process=process, connection=ours, scratch=scratch, printed=printed)


def begin(descriptor: int, parent: int) -> None:
    """Serve as a worker over a channel's end: what a new process does, first and last.

    Its temporary files are made in a folder that the parent removes: one that is killed cannot remove them itself.
    """
    end_with_parent(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # what it starts may hear it
    connection = Channel.of(descriptor)
    try:
        told: _Beginning = connection.recv()
    except EOFError:  # the parent gave up meanwhile
        return
    sys.path[:] = told.path
    tempfile.tempdir = told.folder
    end_with_parent(parent, f"rayproof-{told.kind}")
    getattr(importlib.import_module(told.module), told.function)(told.kind, connection)
