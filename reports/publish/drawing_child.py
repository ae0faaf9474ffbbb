"""One child process that draws: it is told of cases, and tells what became of each; it may die without harm."""

import contextlib
import json
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any


class DrawingChild:
    """A process of `reports.publish.picture_worker`.

    `drawn` is called with a case's name, `failed` with its name and why, both from a thread of its own.
    """

    def __init__(
        self, environment: Mapping[str, str], *, drawn: Callable[[str], None], failed: Callable[[str, str], None]
    ) -> None:
        self._drawn, self._failed = drawn, failed
        self._given, self._answered = 0, 0
        self._current = "the first case"
        # stderr to a file: a pipe that nobody reads would stop a child that complains at length.
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115 (closed with the child)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "reports.publish.picture_worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaints,
            env=environment,
            cwd=Path(__file__).parents[2],
            text=True,
            encoding="utf-8",
            # Ctrl-C is the main process's to answer: a child that it reached first would die with its work.
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

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
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):  # it died; its exit status says so at the end
            self._process.stdin.write(json.dumps(job) + "\n")
            self._process.stdin.flush()

    def close(self, *, kill: bool) -> str | None:
        """Wait until it has drawn everything, or `kill` it; return where and how it ended if not well."""
        if kill:
            self._process.kill()
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):  # what was still in the buffer went to a child that is gone
            self._process.stdin.close()
        self._reader.join()
        assert self._process.stdout is not None
        self._process.stdout.close()
        status = self._process.wait()
        with self._complaints as complaints:
            complaints.seek(0)
            last = complaints.read().decode(errors="replace").strip().splitlines()[-1:]
        if status == 0:
            return None
        how = f"signal {-status}" if status < 0 else f"exit code {status}" + (f", {last[0][:200]}" if last else "")
        return f"{self._current} ({how})"

    def _read(self) -> None:
        """Take down what the process reports."""
        for line in self._process.stdout or ():
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
