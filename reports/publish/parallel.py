"""Cases written on every processor where there are many: compressing images is what takes the time."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any, TypeVar

FEW = 16  # cases with images to compress that one process writes sooner than another one starts

Answer = TypeVar("Answer")


def all_of(write: Callable[..., Answer], jobs: Sequence[tuple[Any, ...]], *, heavy: int) -> list[Answer]:
    """Return what `write` returns for the arguments in each of `jobs`, in order; so many of them are `heavy`."""
    workers = min(os.cpu_count() or 1, heavy // FEW)
    if workers < 2:
        return [write(*job) for job in jobs]
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        return list(pool.map(write, *zip(*jobs, strict=True), chunksize=4))
