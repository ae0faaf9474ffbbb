"""What a worker of a cluster does: it keeps a pool of processes, puts batches of cases through it, and returns bytes.

The processes are those of a run on one machine, started by `subprocess`: a worker of the engine's is daemonic, and
`multiprocessing` starts nothing below such a process. They stay across the batches of a run, since imported
renderers, their kernels and their caches are theirs, and end when the run does, or when nothing has come for a while.
"""

import contextlib
import multiprocessing
import os
import threading
import time
from collections.abc import Iterable, Iterator
from dataclasses import replace
from multiprocessing.util import Finalize
from pathlib import PurePath

from rayproof.reports.processes.scratch import Scratch, sweep
from rayproof.reports.processes.signals import end_with_parent
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.run.cache_store import usual_store
from rayproof.reports.run.case import CasesUnderWay, Source, Terms
from rayproof.reports.run.engine.batch import Answer, Batch, Finished, packed, write
from rayproof.reports.run.engine.facts import Facts, facts
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.workers import RELIEF, sleeping, workers
from rayproof.tracer.kernel.compiler import choose_packaged_llvm

IDLE = 60.0  # s without a batch after which the processes end: who sent the last one may be gone
# What the engine sets in its workers' environment, and a run on one machine has not: how many threads a library has.
OF_THE_ENGINE = "distributed.nanny.pre-spawn-environ"


class StoppedError(RuntimeError):
    """The run was stopped while a batch of it was under way."""


class Machine:
    """The pool of one run on this machine."""

    def __init__(self, batch: Batch) -> None:
        choose_packaged_llvm()
        _as_on_one_machine()
        self._scratch = Scratch()
        self.run, self._terms = batch.run, replace(batch.terms, copies=tuple(self._copies(batch.terms.sources)))
        sweep(self._scratch.folder.parent)
        subject, jobs = batch.terms.subject, batch.limits.jobs or processors()
        self._pool = workers(subject, jobs=jobs, timeout=batch.limits.timeout, folder=self._scratch.folder)
        self._pool.memory = batch.limits.memory
        self._pool.sleeping, self._pool.relief = sleeping(), RELIEF
        self._store = usual_store() if batch.terms.cached else None

    def _copies(self, sources: Iterable[Source]) -> Iterator[tuple[str, str]]:
        """Write the user's own formulas, each in a folder of its own; yield their paths and where they lie now."""
        for number, source in enumerate(sources):
            folder = self._scratch.folder / f"formula-{number}"
            write(source.files, folder)
            yield source.path, str(folder / PurePath(source.path).name)

    def answer(self, batch: Batch, stopped: threading.Event) -> Answer:
        """Return what was found of a batch.

        Raises:
            StoppedError: the run was stopped meanwhile.
            OSError: nothing could be written here.

        """
        start, done = time.perf_counter(), []
        with contextlib.ExitStack() as stack:
            scratch = Scratch(self._scratch.folder)
            stack.callback(scratch.remove)

            def finished(one: PlannedCase, record: CaseRecord) -> None:
                done.append(packed(one.case.name, record, scratch.folder))

            under_way = CasesUnderWay(
                self._terms, self._pool, folder=scratch.folder, store=self._store, finished=finished, amended=finished
            )
            waiting = iter(batch.cases)
            while len(done) < len(batch.cases):
                if stopped.is_set():
                    raise StoppedError
                while under_way.has_room and (one := next(waiting, None)) is not None:
                    under_way.start(one)
                under_way.step()
            under_way.ask_again()
            while under_way.asked_again and not stopped.is_set():
                under_way.step()
        answers: tuple[Finished, ...] = tuple(done)
        return Answer(finished=answers, seconds=time.perf_counter() - start)

    def close(self) -> None:
        """End the processes and remove what they left."""
        self._pool.close()
        self._scratch.remove()


class _Kept:
    """The machine that this process keeps, if it has one."""

    def __init__(self) -> None:
        self.lock = threading.Lock()  # one batch at a time, however many threads a worker has
        self._closing = threading.Lock()  # the run may be over while this process ends
        self.machine: Machine | None = None
        self.timer: threading.Timer | None = None
        self.stopped: dict[str, threading.Event] = {}  # by run

    def close(self) -> None:
        with self._closing:
            if self.machine is not None:
                self.machine.close()
                self.machine = None

    def idle(self) -> None:
        with self.lock:
            self.close()


_KEPT = _Kept()


def work(batch: Batch) -> Answer:
    """Put a batch of cases to the test on this machine: what a task of the engine's does."""
    with _KEPT.lock:
        if _KEPT.timer is not None:
            _KEPT.timer.cancel()
        stopped = _KEPT.stopped.setdefault(batch.run, threading.Event())
        if stopped.is_set():
            raise StoppedError
        if _KEPT.machine is None or _KEPT.machine.run != batch.run:
            _KEPT.close()
            _KEPT.machine = Machine(batch)
            Finalize(None, _KEPT.close, exitpriority=10)
        try:
            return _KEPT.machine.answer(batch, stopped)
        except BaseException:
            _KEPT.close()  # whatever it was doing is nobody's any more
            raise
        finally:
            _KEPT.timer = threading.Timer(IDLE, _KEPT.idle)
            _KEPT.timer.daemon = True
            _KEPT.timer.start()


def stop(run: str) -> None:
    """End what this machine does for a run, now or once it looks: the run is over."""
    _KEPT.stopped.setdefault(run, threading.Event()).set()
    threading.Thread(target=_KEPT.idle, daemon=True).start()  # which waits for a batch that is under way


def tell(terms: Terms) -> tuple[Facts, int]:
    """Return what this machine is, and how many processors it has.

    From then on a worker below a nanny ends with it even where it is stopped, and its processes with the worker: the
    engine has a thread watch the nanny, which does not run then.
    """
    nanny = multiprocessing.parent_process()
    if nanny is not None and nanny.pid is not None:
        end_with_parent(nanny.pid)
    return facts(terms), processors()


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _as_on_one_machine() -> None:
    """Take out of the environment what the engine put there, so that renderers find what they find without it."""
    import dask.config

    for name, value in dict(dask.config.get(OF_THE_ENGINE, {})).items():
        if os.environ.get(str(name)) == str(value):
            del os.environ[str(name)]
