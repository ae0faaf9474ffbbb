"""`Pool`: starts worker processes by kind, gives them tasks with deadlines, runs sleeping kinds in addition to `jobs`.

`Pool.submit` returns a `Future`, which coroutines await; `Coroutines` continues the coroutines whose futures are done.

A worker is a new interpreter that imports `rayproof` and nothing of the calling script: `multiprocessing` would run an
unguarded script a second time, and does not allow its daemonic processes to have children. A worker ends with its
parent, however the parent ends, and process listings show it as `rayproof-` and its kind. Output of libraries in it
goes to an unnamed file, whose last line is reported if the process fails.

If a worker dies or overruns its deadline, its task, if any, fails; it is replaced for the next task of its kind. The
files in its temporary folder are removed. The deadline includes sending the task and receiving the reply, so that the
pool does not wait for a worker that was stopped in the middle of either.

A sleeping program uses no processor: kinds whose programs poll or wait have several workers each, in addition to the
`jobs`. The processor time of a kind's last tasks decides whether it sleeps. If all workers of a kind have had their
tasks for long and a processor is idle, the kind gets one more worker. A large task takes much of the machine's memory,
so only one of them runs at a time, and its worker ends with it.
"""

import concurrent.futures
import contextlib
import importlib
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Collection, Coroutine, Generator, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, TypeVar

from rayproof import HOLDER
from rayproof.reports.processes.scratch import Scratch
from rayproof.reports.processes.signals import deaf, end_with_parent
from rayproof.reports.processes.worker import PREPARE, Channel, Reply, channels

START = (
    "import sys; sys.path.insert(0, sys.argv[1]); "
    "from rayproof.reports.processes.pool import begin; begin(*map(int, sys.argv[2:]))"
)
PARTING = 5.0  # s for a process to end after its channel has closed or it was killed
LAST = 1000  # bytes at the end of its output that are searched for its last line


@dataclass(frozen=True, kw_only=True)
class WorkerProcess:
    """A process that serves one kind of task, and this process's end of the channel to it."""

    process: subprocess.Popen[bytes]
    connection: Channel
    scratch: Scratch
    printed: IO[bytes]  # its standard output and standard error

    @property
    def alive(self) -> bool:
        """Return whether it still runs."""
        return self.process.poll() is None

    @property
    def memory(self) -> int:
        """Return its resident memory [bytes], 0 if it has ended."""
        import psutil

        try:
            return psutil.Process(self.process.pid).memory_info().rss
        except psutil.Error:
            return 0

    def how_it_ended(self) -> str:
        """Return a description of the end of a process that closed its channel."""
        self._wait()
        code = self.process.returncode
        if code is None:
            return "it closed its channel and runs on"
        if code < 0:
            try:
                return f"signal {signal.Signals(-code).name}"
            except ValueError:
                return f"signal {-code}"
        last_line = self._last_line() if code else ""
        return f"exit code {code}: {last_line}" if last_line else f"exit code {code}"

    def _last_line(self) -> str:
        self.printed.seek(0, os.SEEK_END)
        self.printed.seek(max(0, self.printed.tell() - LAST))
        lines = self.printed.read().decode(errors="replace").split("\n")
        last = next((line for line in reversed(lines) if line.strip()), "")
        return "".join(letter for letter in last.strip() if letter.isprintable())

    def end(self) -> None:
        """End it and all its descendants: a program under test does not outlive the run that called it."""
        self.connection.close()
        if self.alive:
            from rayproof.reports.processes.signals import end_below

            end_below(self.process.pid)
        self.process.kill()

    def clean_up(self) -> None:
        """Wait for its end, for at most PARTING s, and remove its files."""
        self._wait()
        self.printed.close()
        self.scratch.remove()

    def _wait(self) -> None:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(timeout=PARTING)


@dataclass(frozen=True, kw_only=True)
class _Beginning:
    """The first message to a new process."""

    module: str  # of the function that serves tasks
    function: str
    kind: str
    folder: str  # for temporary files
    path: tuple[str, ...]  # sys.path


def started(kind: str, target: Callable[[str, Any], None], within: Path | None = None) -> WorkerProcess:
    """Return a new process in which `target`, a function at the top of its module, serves tasks of `kind`.

    Its folder for temporary files is made in `within`, by default in this process's own.
    """
    scratch = Scratch(within)
    try:
        own_end, worker_end = channels()
        printed = tempfile.TemporaryFile(dir=scratch.folder)  # noqa: SIM115  closed by `clean_up`
        with deaf():
            process = subprocess.Popen(
                [sys.executable, "-c", START, str(HOLDER), str(worker_end.fileno()), str(os.getpid())],
                stdin=subprocess.DEVNULL,
                stdout=printed,
                stderr=printed,
                pass_fds=[worker_end.fileno()],
            )
        worker_end.close()
        own_end.post(
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
    return WorkerProcess(process=process, connection=own_end, scratch=scratch, printed=printed)


def begin(descriptor: int, parent: int) -> None:
    """Serve as a worker over the channel's end `descriptor`: the main function of a new process.

    Its temporary files are made in a folder that the parent removes, because a killed process cannot remove them.
    """
    end_with_parent(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # child processes may receive it
    connection = Channel.of(descriptor)
    try:
        beginning: _Beginning = connection.recv()
    except EOFError:  # the parent has closed the channel
        return
    sys.path[:] = beginning.path
    tempfile.tempdir = beginning.folder
    end_with_parent(parent, f"rayproof-{beginning.kind}")
    getattr(importlib.import_module(beginning.module), beginning.function)(beginning.kind, connection)


Result = TypeVar("Result")


class Future(concurrent.futures.Future[Result]):
    """A result that comes later; a coroutine of `Coroutines` can await it."""

    def __await__(self) -> Generator["Future[Result]", None, Result]:
        """Suspend until the future is done, and return its result."""
        if not self.done():
            yield self
        return self.result()


class Coroutines:
    """Coroutines that await futures, without an event loop: the code that waits for their results calls `step`.

    An exception in a coroutine is raised by `start` or `step`.
    """

    def __init__(self) -> None:
        # Each coroutine with the future that it awaits and the future of its own result.
        self._suspended: list[tuple[Coroutine[Future[Any], None, Any], Future[Any], Future[Any]]] = []

    def start(self, coroutine: Coroutine[Future[Any], None, Result]) -> Future[Result]:
        """Run a coroutine until it awaits a future, and return the future of its result."""
        result = Future[Result]()
        self._continue(coroutine, result)
        return result

    def step(self) -> None:
        """Continue the coroutines whose awaited futures are done."""
        suspended, self._suspended = self._suspended, []
        for coroutine, awaited, result in suspended:
            if awaited.done():
                self._continue(coroutine, result)
            else:
                self._suspended.append((coroutine, awaited, result))

    def _continue(self, coroutine: Coroutine[Future[Any], None, Result], result: Future[Result]) -> None:
        try:
            self._suspended.append((coroutine, coroutine.send(None), result))
        except StopIteration as end:
            result.set_result(end.value)


GLANCE = 1.0  # s, the longest wait at a time
# A kind sleeps if its last LAST_TASKS tasks took at least LONG_ENOUGH s together, with processor time for at most the
# share SLEEPING of it. The share is small, so that a program that computes does not count as sleeping on a machine with
# up to eight busy processes per processor.
LAST_TASKS, LONG_ENOUGH, SLEEPING = 3, 0.3, 1 / 8
SLEEPERS = 6  # workers of a kind that sleeps; each costs memory and the time of its imports
# A worker is replaced after MOST_TASKS tasks, or if its memory has grown by GROWTH bytes since its first LOOKED_AT
# tasks; both are tested every LOOKED_AT tasks.
MOST_TASKS, GROWTH, LOOKED_AT = 2000, 2**31, 20
# If a wait takes this much longer than planned [s], this process was stopped, took calls, or its machine slept, and the
# deadlines of the workers are extended.
ASLEEP = 1.0


@dataclass(kw_only=True)
class _Worker:
    process: WorkerProcess
    future: Future[Reply] | None = None  # of the reply to its task
    limit: float = 0.0  # s that its task may take
    deadline: float = 0.0
    started: float = 0.0
    large: bool = False  # whether its task is large
    tasks: int = 0  # number of tasks done
    settled: int = 0  # its memory after the first LOOKED_AT tasks [bytes]


@dataclass(kw_only=True)
class _Waiting:
    """A task that waits for a worker."""

    kind: str
    task: Any
    future: Future[Reply]  # of its reply
    seconds: float | None
    large: bool


_CALLS: dict[int, Callable[[], None]] = {}  # by descriptor


@contextlib.contextmanager
def taking_calls(descriptor: int, take: Callable[[], None]) -> Iterator[None]:
    """Have every waiting pool of this process call `take` when a descriptor has something to read."""
    _CALLS[descriptor] = take
    try:
        yield
    finally:
        del _CALLS[descriptor]


class Pool:
    """Run tasks in workers by kind; `step` waits for an event and sets the results of futures.

    A kind has one worker, or the number in `copies`; a renderer with its own compiler should have only one. The time
    limit of a task is `timeout` [s], or its kind's in `timeouts`. Only the kinds in `may_sleep` can count as
    sleeping. A worker calls `target`, a function at the top of its module, with its kind and its end of the channel.
    Each has a folder for temporary files in `folder`, by default in this process's own.
    """

    def __init__(
        self,
        *,
        jobs: int,
        timeout: float,
        copies: Mapping[str, int] | None = None,
        timeouts: Mapping[str, float] | None = None,
        may_sleep: Collection[str] = (),
        folder: Path | None = None,
        target: Callable[[str, Any], None],
    ) -> None:
        self._copies = copies or {}
        self._jobs = jobs
        self._timeout = timeout
        self._timeouts = timeouts or {}
        self._target, self._folder = target, folder
        self._workers: dict[tuple[str, int], _Worker] = {}
        self.memory = float("inf")  # bytes that a worker may use; may be set later
        self.relief = float(
            "inf"
        )  # seconds of waiting after which a kind of tasks gets another worker; may be set later
        # Kind -> (duration, processor time) of its last tasks [s].
        self._last: dict[str, deque[tuple[float, float]]] = {kind: deque(maxlen=LAST_TASKS) for kind in may_sleep}
        self._urgent: deque[_Waiting] = deque()
        self._waiting: deque[_Waiting] = deque()

    def submit(
        self,
        kind: str,
        task: Any,
        *,
        first: bool = False,
        seconds: float | None = None,
        large: bool = False,
    ) -> Future[Reply]:
        """Queue a task for a worker of `kind`, before all others if `first`; return the future of its reply.

        It may take `seconds`, if that is more than the pool's limit. A `large` task waits until no other large task
        runs.
        """
        queue, future = self._urgent if first else self._waiting, Future[Reply]()
        queue.append(_Waiting(kind=kind, task=task, future=future, seconds=seconds, large=large))
        return future

    def reply(self, kind: str, task: Any, *, seconds: float | None = None) -> Reply:
        """Submit a task and wait for its reply."""
        future = self.submit(kind, task, seconds=seconds)
        while not future.done():
            self.step()
        return future.result()

    @property
    def busy(self) -> dict[str, float]:
        """Return the kinds of the workers that have a task, and the time since they got it [s]."""
        now = time.monotonic()
        return {kind: now - worker.started for (kind, _), worker in self._busy().items()}

    def prepare(self, kind: str, task: Any = None) -> None:
        """Start a worker of `kind` before its first task, so that its imports are done by then.

        `task`, if not None, is done before all tasks that are not `first`; its reply is ignored.
        """
        place = (kind, 0)
        if place in self._workers:
            return
        with contextlib.suppress(OSError):  # it died; its first task will report that
            self._spawn(place).process.connection.post(PREPARE)
        if task is not None:
            self.submit(kind, task, first=True)

    def spare(self) -> int:
        """Start waiting tasks if possible, and return how many more tasks could compute."""
        self.start()
        return self._jobs - self._computing(self._sleeping)

    @property
    def idle(self) -> bool:
        """Return whether no task runs or waits."""
        return not self._urgent and not self._waiting and not self._busy()

    def step(self) -> None:
        """Start waiting tasks if possible, then wait a little until a worker replies, dies or overruns."""
        self.start()
        busy = self._busy()
        if not busy:
            return
        ready = self._ready(busy)
        for place, worker in busy.items():
            if worker.process.connection.fileno() in ready:
                self._exchange(place, worker)
            if worker.future is not None and time.monotonic() >= worker.deadline:
                self._lose(place, worker, f"no answer within {worker.limit:g} s; stopped", stopped=True)
            elif worker.future is not None and self.memory < float("inf") and worker.process.memory > self.memory:
                self._lose(place, worker, f"it took more than {self.memory / 2**30:g} GiB of memory; stopped")

    @staticmethod
    def _ready(busy: Mapping[tuple[str, int], _Worker]) -> set[int]:
        """Wait until a worker's channel is ready or a deadline is near, and return the ready descriptors.

        The functions of `taking_calls` are called too; their time does not count against the workers' deadlines.
        """
        poll = select.poll()
        for descriptor in _CALLS:
            poll.register(descriptor, select.POLLIN)
        for worker in busy.values():
            channel = worker.process.connection
            poll.register(channel, select.POLLIN | (select.POLLOUT if channel.unsent else 0))
        start = time.monotonic()
        rest = min(GLANCE, max(0.0, min(worker.deadline for worker in busy.values()) - start))
        ready = {descriptor for descriptor, _ in poll.poll(1000 * rest)}
        for descriptor in ready.intersection(_CALLS):
            _CALLS[descriptor]()
        asleep = time.monotonic() - start - rest
        if asleep > ASLEEP:
            for worker in busy.values():
                worker.deadline += asleep
        return ready

    def close(self) -> None:
        """Stop every worker immediately."""
        for worker in self._workers.values():
            worker.process.end()
        for worker in self._workers.values():
            worker.process.clean_up()
        self._workers.clear()

    def _limit(self, kind: str) -> float:
        return self._timeouts.get(kind, self._timeout)

    def _busy(self) -> dict[tuple[str, int], _Worker]:
        return {place: worker for place, worker in self._workers.items() if worker.future is not None}

    def _computing(self, sleeping: Collection[str]) -> int:
        """Return the number of workers that have a task and are not of a sleeping kind."""
        return sum(worker.future is not None and kind not in sleeping for (kind, _), worker in self._workers.items())

    def start(self) -> None:
        """Give waiting tasks, in their order, to idle workers of their kind, without waiting."""
        for queue in (self._urgent, self._waiting):
            self._start_from(queue)

    def _start_from(self, queue: deque[_Waiting]) -> None:
        postponed: list[_Waiting] = []
        full: set[str] = set()  # kinds whose workers all have a task
        sleeping = self._sleeping
        computing = self._computing(sleeping)
        # Hundreds of small cases may wait; the loop ends early if no worker can take any of them.
        asleep = sleeping.intersection(task.kind for task in queue)
        while queue and (computing < self._jobs or not asleep <= full):
            task = queue.popleft()
            if task.kind in full or not (task.kind in sleeping or computing < self._jobs):
                postponed.append(task)
                continue
            place = self._free_place(task.kind)
            if place is None:
                full.add(task.kind)
            if place is None or (task.large and any(worker.large for worker in self._busy().values())):
                postponed.append(task)
                continue
            self._bury(place)
            worker = self._workers.get(place) or self._spawn(place)
            worker.future = task.future
            worker.large = task.large
            worker.limit = max(self._limit(task.kind), task.seconds or 0.0)
            worker.started = time.monotonic()
            worker.deadline = worker.started + worker.limit
            try:
                worker.process.connection.post(task.task)
            except OSError:
                self._lose(place, worker, "the worker had died")
            computing = self._computing(sleeping)
        queue.extendleft(reversed(postponed))

    def _free_place(self, kind: str) -> tuple[str, int] | None:
        """Return the place of an idle worker of `kind`, else that of a new worker, None if all are busy."""
        count = max(self._copies.get(kind, 1), SLEEPERS if self._sleeps(kind) else 1)
        places = [(kind, copy) for copy in range(count)]
        begun = [worker.started for place, worker in self._busy().items() if place in places]
        if len(begun) == count and time.monotonic() - max(begun) >= self.relief:
            places.append((kind, count))
        free = [place for place in places if place not in self._workers or self._workers[place].future is None]
        return min(free, key=lambda place: place not in self._workers, default=None)

    @property
    def _sleeping(self) -> set[str]:
        return {kind for kind in self._last if self._sleeps(kind)}

    def _sleeps(self, kind: str) -> bool:
        """Return whether the last tasks of a kind used little processor time."""
        last = self._last.get(kind, ())
        seconds, computed = sum(took for took, _ in last), sum(took for _, took in last)
        return len(last) == LAST_TASKS and seconds >= LONG_ENOUGH and computed <= SLEEPING * seconds

    def _spawn(self, place: tuple[str, int]) -> _Worker:
        self._workers[place] = worker = _Worker(process=started(place[0], self._target, self._folder))
        return worker

    def _exchange(self, place: tuple[str, int], worker: _Worker) -> None:
        """Send the unsent part of a task, and receive the part of its reply that has arrived."""
        try:
            with contextlib.suppress(BrokenPipeError):  # its last reply may still be in the buffer
                worker.process.connection.flush()
            whole, reply = worker.process.connection.receive()
        except (EOFError, OSError):
            self._lose(place, worker, f"the worker died ({worker.process.how_it_ended()})")
            return
        if whole and worker.future is not None:
            future, worker.future = worker.future, None
            if place[0] in self._last and reply.computed is not None:
                self._last[place[0]].append((reply.seconds, reply.computed))
            worker.tasks += 1
            # Caches and freed memory of a large task are of no further use, but would stay in the worker's memory.
            if worker.large or self._worn(worker):
                self._forget(place, worker)
            future.set_result(reply)

    @staticmethod
    def _worn(worker: _Worker) -> bool:
        """Return whether a worker should be replaced: compilers keep some memory for each task."""
        if worker.tasks % LOOKED_AT:
            return False
        size = worker.process.memory
        worker.settled = worker.settled or size
        return worker.tasks >= MOST_TASKS or size > worker.settled + GROWTH

    def _bury(self, place: tuple[str, int]) -> None:
        """Remove a worker that died while it was idle, so that the next task does not fail."""
        worker = self._workers.get(place)
        if worker is not None and not worker.process.alive:
            self._lose(place, worker, "the worker had died")

    def _lose(self, place: tuple[str, int], worker: _Worker, why: str, *, stopped: bool = False) -> None:
        """Reply to a lost worker's task with an error and remove the worker; `stopped`: it overran its deadline."""
        self._forget(place, worker)
        future, worker.future = worker.future, None
        if future is not None:
            seconds = time.monotonic() - worker.started
            future.set_result(Reply(value=None, error=why, trace=None, seconds=seconds, stopped=stopped))

    def _forget(self, place: tuple[str, int], worker: _Worker) -> None:
        del self._workers[place]
        worker.process.end()
        worker.process.clean_up()
