"""One scene at one size in a process of its own, and the next one's started as soon as nothing is timed any more.

What a renderer keeps of a scene that is done slows the next: after a thousand spheres Mitsuba took two to seven times
as long for a mesh.
"""

from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from rayproof.cases.benchmark_scenes import chosen
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Channel, serve
from rayproof.tracer.configuration import Configuration
from tests.benchmarks.bench import CONTENDERS
from tests.benchmarks.bench.contenders.ours import ask_about
from tests.benchmarks.bench.document import entry, measured
from tests.benchmarks.bench.records import MachineRecord, SceneRecord

KIND = "bench"


class BenchError(RuntimeError):
    """A scene was not timed: its process died or met an error."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """What is to be timed."""

    scene: str
    size: tuple[int, int]  # px
    contenders: tuple[str, ...]
    machine: MachineRecord
    budget: float  # s
    formulas: str = "float32"  # by which the tracer renders: a configuration, of which the precision does not matter


def _steps(task: Task) -> Iterator[Any]:
    """Load what is to be timed; time it, which nobody may disturb; then say what was found, which is not timed."""
    (bench,) = chosen((task.scene,), quick=False)
    scene = bench.scene(*task.size)
    CONTENDERS.load()
    ask_about(Configuration.parse(task.formulas))
    yield None
    found = measured(scene, task.contenders, task.budget)
    yield None
    yield entry(bench, scene, found, task.machine)


def _handler(kind: str) -> Callable[[Task], Any]:
    """Return what takes the next step of the one task that this process has."""
    begun: list[Iterator[Any]] = []

    def take(task: Task) -> Any:
        if not begun:
            begun.append(_steps(task))
        return next(begun[0])

    return take


def _serve(kind: str, connection: Channel) -> None:
    serve(kind, connection, _handler)


class _Apart:
    """A task in a process of its own, which begins to load at once; close it."""

    def __init__(self, task: Task) -> None:
        self._task = task
        self._pool = Pool(jobs=1, timeout=float("inf"), target=_serve)
        self._ask()

    def _ask(self) -> None:
        """Ask for the next step, and do not wait."""
        self._reply = self._pool.submit(KIND, self._task)
        self._pool.start()

    def _answer(self) -> Any:
        """Return what the step that was asked for gave; raise BenchError if it failed."""
        while not self._reply.done():
            self._pool.step()
        reply = self._reply.result()
        if reply.error is not None:
            width, height = self._task.size
            raise BenchError(f"{self._task.scene}, {width}x{height}: {reply.error}")
        return reply.value

    def time(self) -> None:
        """Wait until it is loaded, and time it."""
        self._answer()
        self._ask()
        self._answer()
        self._ask()

    def entry(self) -> SceneRecord:
        """Return the scene's entry in the benchmark's document, once it is timed."""
        return self._answer()

    def close(self) -> None:
        """End the process."""
        self._pool.close()


def timed_apart(tasks: Sequence[Task]) -> Generator[SceneRecord | BenchError]:
    """Yield each task's entry in the benchmark's document, or why there is none.

    While one is timed there is no other; while the errors of its pictures are found, the next one loads.
    """
    waiting, current, following = deque(tasks), None, None
    try:
        while waiting or following is not None:
            current, following = following or _Apart(waiting.popleft()), None
            try:
                current.time()
                following = _Apart(waiting.popleft()) if waiting else None
                found = current.entry()
            except BenchError as error:
                found = error
            current.close()
            yield found
    finally:
        for one in (current, following):
            if one is not None:
                one.close()
