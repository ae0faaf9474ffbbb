"""One scene at one size in a process of its own.

What a renderer keeps of a scene that is done slows the next: after a thousand spheres Mitsuba took two to seven times
as long for a mesh.
"""

from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from reports.bench.document import entry
from reports.bench.scenes import chosen
from reports.run.pool import Pool
from reports.run.worker import Reply, serve

KIND = "bench"


class BenchError(RuntimeError):
    """A scene was not timed: its process died or met an error."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """What is to be timed."""

    scene: str
    size: tuple[int, int]  # px
    contenders: tuple[str, ...]
    machine: dict[str, Any]
    budget: float  # s


def _timed(task: Task) -> dict[str, Any]:
    (bench,) = chosen((task.scene,), quick=False)
    return entry(bench, bench.scene(*task.size), task.contenders, task.machine, task.budget)


def _serve(kind: str, connection: Connection) -> None:
    serve(kind, connection, lambda kind: _timed)


def timed_apart(task: Task) -> dict[str, Any]:
    """Return a scene's entry in the benchmark's document.

    Raises:
        BenchError: the process died or met an error.

    """
    pool, replies = Pool(jobs=1, timeout=float("inf"), target=_serve), list[Reply]()
    try:
        pool.submit(KIND, task, replies.append)
        while not replies:
            pool.step()
    finally:
        pool.close()
    (reply,) = replies
    if reply.error is not None:
        width, height = task.size
        raise BenchError(f"{task.scene}, {width}x{height}: {reply.error}")
    return reply.value
