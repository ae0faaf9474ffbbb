"""One child process that draws: it is told of cases, and tells what became of each; it may die or hang without harm.

Nobody waits for it: a thread of its own hands over the cases, another hears of them, and at the end a child that says
nothing for as long as one picture may take is killed.
"""

import contextlib
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from rayproof.reports import HOLDER

GLANCE = 0.5  # s between looks at whether it still says something
PARTING = 5.0  # s for a process that was killed, or has said all, to be gone


class DrawingChild:
    """A process of `reports.publish.scene3d.picture_worker`.

    `drawn` is called with a case's name, `failed` with its name and why, both from a thread of its own. `seconds` is
    how long one picture may take.
    """

    def __init__(
        self,
        environment: Mapping[str, str],
        *,
        seconds: float,
        drawn: Callable[[str], None],
        failed: Callable[[str, str], None],
    ) -> None:
        self._drawn, self._failed, self._seconds = drawn, failed, seconds
        self._heard = time.monotonic()  # when it last said something
        self._jobs: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._given, self._answered = 0, 0
        self._current = "the first case"
        # stderr to a file: a pipe that nobody reads would stop a child that complains at length.
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115 (closed with the child)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "rayproof.reports.publish.scene3d.picture_worker", str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaints,
            env=environment,
            cwd=HOLDER,
            text=True,
            encoding="utf-8",
            # Ctrl-C is the main process's to answer: a child that it reached first would die with its work.
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        threading.Thread(target=self._write, daemon=True).start()

    @property
    def alive(self) -> bool:
        """Return whether the process has not ended."""
        return self._process.poll() is None

    @property
    def waiting(self) -> int:
        """Return how many cases it was told of and has not answered."""
        return self._given - self._answered

    def submit(self, job: Mapping[str, Any]) -> None:
        """Have a case drawn."""
        self._given += 1
        self._jobs.put(json.dumps(job) + "\n")

    def close(self, *, kill: bool) -> str | None:
        """Wait until it has drawn everything, or `kill` it; return where and how it ended if not well."""
        self._jobs.put(None)
        start, hung = time.monotonic(), False
        try:
            while not kill and self._reader.is_alive():
                self._reader.join(timeout=GLANCE)
                hung = time.monotonic() - max(start, self._heard) > self._seconds
                kill = hung
        finally:
            if kill or self._reader.is_alive():
                self._process.kill()
        try:
            status = self._process.wait(timeout=PARTING)
        except subprocess.TimeoutExpired:  # a driver that waits for its device does not even hear SIGKILL
            return f"{self._current} (it cannot be ended)"
        self._reader.join(timeout=PARTING)
        assert self._process.stdout is not None
        if not self._reader.is_alive():
            self._process.stdout.close()
        with self._complaints as complaints:
            complaints.seek(0)
            last = complaints.read().decode(errors="replace").strip().splitlines()[-1:]
        if hung:
            return f"{self._current} (nothing for {self._seconds:g} s; stopped)"
        if status == 0:
            return None
        how = f"signal {-status}" if status < 0 else f"exit code {status}" + (f", {last[0][:200]}" if last else "")
        return f"{self._current} ({how})"

    def _write(self) -> None:
        """Hand over the cases, waiting where the process is behind."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):  # it died; its exit status says so at the end
            while (job := self._jobs.get()) is not None:
                self._process.stdin.write(job)
                self._process.stdin.flush()
        with contextlib.suppress(OSError):  # what was still in the buffer went to a child that is gone
            self._process.stdin.close()

    def _read(self) -> None:
        """Take down what the process reports."""
        for line in self._process.stdout or ():
            self._heard = time.monotonic()
            try:
                report = json.loads(line)
            except json.JSONDecodeError:
                continue  # What a graphics driver says, or half a line of a child that died.
            name = report["name"]
            if report["state"] == "started":
                self._current = name
                continue
            self._answered += 1
            if report["state"] == "failed":
                self._failed(name, report["why"])
            else:
                self._drawn(name)
