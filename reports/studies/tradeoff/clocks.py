"""Seconds of renderers that are no formula of ours, and the interleaving of everything that is to be timed."""

import time
from collections.abc import Callable, Sequence

import drjit as dr
import numpy as np

Launch = Callable[[], float]  # runs once and returns its seconds


def kernel_seconds(run: Callable[[], object]) -> float:
    """Return how long the kernels ran that `run` launched through Dr.Jit, whoever wrote them [s]."""
    before = dr.flag(dr.JitFlag.KernelHistory)
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    try:
        dr.kernel_history_clear()
        run()
        dr.sync_thread()
        return sum(kernel["execution_time"] for kernel in dr.kernel_history([dr.KernelType.JIT])) * 1e-3
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, before)


def wall_seconds(run: Callable[[], object]) -> float:
    """Return how long `run` took [s]."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def interleave(launches: Sequence[Launch], *, repetitions: int, budget: float) -> list[np.ndarray]:
    """Return the seconds of each launch in warm repetitions, all visited in a new order each time.

    A launch that would keep us longer than `budget` [s] in all, whatever its own clock says, is repeated less often, an
    odd number of times.
    """
    for launch in launches:
        launch()
    warm = [wall_seconds(launch) for launch in launches]
    counts = [max(3, min(repetitions, int(budget / seconds))) | 1 for seconds in warm]
    seconds: list[list[float]] = [[] for _ in launches]
    generator = np.random.default_rng(6)
    for repetition in range(max(counts, default=0)):
        for index in generator.permutation(len(launches)):
            if repetition < counts[index]:
                seconds[index].append(launches[index]())
    return [np.array(found) for found in seconds]
