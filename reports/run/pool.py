"""The pool: one process per kind of worker, at most `jobs` busy at once, each task with a deadline.

A worker that dies or overruns its deadline costs one task; it is replaced when the next task of its kind comes.
"""

import multiprocessing
import signal
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from typing import Any

from reports.run.worker import Reply, serve


@dataclass(kw_only=True)
class _Worker:
    process: BaseProcess
    connection: Any  # multiprocessing's Connection; on Windows its PipeConnection
    done: Callable[[Reply], None] | None = None
    deadline: float = 0.0
    started: float = 0.0


class Pool:
    """Run tasks in workers by kind; `step` waits for something to happen and calls back."""

    def __init__(self, *, jobs: int, timeout: float, target: Callable[[str, Any], None] = serve) -> None:
        self._jobs = jobs
        self._timeout = timeout
        self._target = target
        self._context = multiprocessing.get_context("spawn")
        self._workers: dict[str, _Worker] = {}
        self._waiting: deque[tuple[str, Any, Callable[[Reply], None]]] = deque()

    def submit(self, kind: str, task: Any, done: Callable[[Reply], None], *, first: bool = False) -> None:
        """Queue a task for a worker of `kind`; `done` gets its reply. `first` puts it before what already waits."""
        (self._waiting.appendleft if first else self._waiting.append)((kind, task, done))

    @property
    def idle(self) -> bool:
        """Say whether nothing runs and nothing waits."""
        return not self._waiting and not self._busy()

    def step(self) -> None:
        """Start what can start, then wait for one worker at least to answer, die or overrun."""
        self._start_ready()
        busy = self._busy()
        if not busy:
            return
        rest = max(0.0, min(worker.deadline for worker in busy.values()) - time.monotonic())
        ready = set(wait([worker.connection for worker in busy.values()], timeout=rest))
        for kind, worker in busy.items():
            if worker.connection in ready:
                self._receive(kind, worker)
            elif time.monotonic() >= worker.deadline:
                self._lose(kind, worker, f"no answer within {self._timeout:g} s; stopped")

    def close(self) -> None:
        """Stop every worker, now."""
        for worker in self._workers.values():
            worker.connection.close()
            worker.process.kill()
        for worker in self._workers.values():
            worker.process.join()
        self._workers.clear()

    def _busy(self) -> dict[str, _Worker]:
        return {kind: worker for kind, worker in self._workers.items() if worker.done is not None}

    def _start_ready(self) -> None:
        """Give waiting tasks, in order, to idle workers of their kind."""
        postponed: list[tuple[str, Any, Callable[[Reply], None]]] = []
        while self._waiting and len(self._busy()) < self._jobs:
            kind, task, done = self._waiting.popleft()
            worker = self._workers.get(kind) or self._spawn(kind)
            if worker.done is not None:
                postponed.append((kind, task, done))
                continue
            worker.done = done
            worker.started = time.monotonic()
            worker.deadline = worker.started + self._timeout
            try:
                worker.connection.send(task)
            except OSError:
                self._lose(kind, worker, "the worker had died")
        self._waiting.extendleft(reversed(postponed))

    def _spawn(self, kind: str) -> _Worker:
        ours, theirs = self._context.Pipe()
        process = self._context.Process(target=self._target, args=(kind, theirs), daemon=True, name=f"rayproof-{kind}")
        process.start()
        theirs.close()
        self._workers[kind] = worker = _Worker(process=process, connection=ours)
        return worker

    def _receive(self, kind: str, worker: _Worker) -> None:
        try:
            reply = worker.connection.recv()
        except (EOFError, OSError):
            worker.process.join(timeout=5)
            self._lose(kind, worker, f"the worker died ({_how(worker.process.exitcode)})")
            return
        done, worker.done = worker.done, None
        if done is not None:
            done(reply)

    def _lose(self, kind: str, worker: _Worker, why: str) -> None:
        """Answer a lost worker's task with an error and forget the worker."""
        del self._workers[kind]
        worker.connection.close()
        worker.process.kill()
        worker.process.join()
        done, worker.done = worker.done, None
        if done is not None:
            done(Reply(value=None, error=why, trace=None, seconds=time.monotonic() - worker.started))


def _how(code: int | None) -> str:
    """Return a process's end in words."""
    if code is not None and code < 0:
        try:
            return f"signal {signal.Signals(-code).name}"
        except ValueError:
            return f"signal {-code}"
    return f"exit code {code}"
