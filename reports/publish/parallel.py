"""Cases written on every processor where there are many: compressing images is what takes the time."""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from itertools import islice
from multiprocessing import get_context
from typing import Any, TypeVar

FEW = 16  # cases with images to compress that one process writes sooner than another one starts
AT_ONCE = 32  # cases in memory

Answer = TypeVar("Answer")
Job = tuple[Any, ...]
Write = Callable[[Callable[..., Answer], Iterable[Job]], Iterator[Answer]]


@contextmanager
def writers(heavy: int) -> Iterator[Write]:
    """Give a function that yields what `write` returns for the arguments in each of some jobs, in their order.

    `heavy` of all jobs have images to compress. No more than `AT_ONCE` are taken from the jobs before they are done.
    """
    workers = min(os.cpu_count() or 1, heavy // FEW)
    if workers < 2:
        yield lambda write, jobs: (write(*job) for job in jobs)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:

        def answers(write: Callable[..., Answer], jobs: Iterable[Job]) -> Iterator[Answer]:
            waiting = iter(jobs)
            while some := list(islice(waiting, AT_ONCE)):
                yield from pool.map(write, *zip(*some, strict=True), chunksize=4)

        yield answers


def all_of(write: Callable[..., Answer], jobs: Sequence[Job], *, heavy: int) -> list[Answer]:
    """Return what `write` returns for the arguments in each of `jobs`, in order; so many of them are `heavy`."""
    with writers(heavy) as written:
        return list(written(write, jobs))
