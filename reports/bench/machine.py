"""What this machine can do at most, measured as our kernels would: multiply-adds, divisions, and bytes written."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from reports.bench.kernels import kernels

WIDTH = 2**16  # lanes: enough packets for every thread, few enough to stay in the caches
CHAIN = 64  # operations a lane
CHAINS = 8  # independent ones, more than any latency
BYTES = 2**26  # written at once: beyond every cache
REPETITIONS = 25


def machine() -> dict[str, Any]:
    """Return the peaks: Gflop/s of float32 and float64 multiply-adds, G/s of divisions, GB/s of writes, threads."""
    import drjit.llvm as backend

    return {
        "threads": dr.thread_count(),
        "fma_gflops": 2 * _rate(backend.Float, _multiply_adds) / 1e9,
        "fma_float64_gflops": 2 * _rate(backend.Float64, _multiply_adds) / 1e9,
        "divisions_per_second": _rate(backend.Float, _divisions),
        "write_bytes_per_second": _write_rate(backend),
    }


def _multiply_adds(x: Any, y: Any) -> Any:
    return dr.fma(x, y, y)


def _divisions(x: Any, y: Any) -> Any:
    return y / x


def _rate(kind: Any, step: Callable[[Any, Any], Any]) -> float:
    """Return how many of an operation the machine does a second, over all threads."""
    starts = [dr.opaque(kind, 1.0 + 0.125 * index, WIDTH) for index in range(CHAINS)]
    factor = dr.opaque(kind, 0.999, WIDTH)

    def run() -> None:
        values = list(starts)
        for _ in range(CHAIN):
            values = [step(value, factor) for value in values]
        total = values[0]
        for value in values[1:]:
            total = total + value
        dr.eval(total)
        dr.sync_thread()

    return WIDTH * CHAINS * CHAIN / _best(run)


def _write_rate(backend: Any) -> float:
    count = BYTES // 4
    value = dr.opaque(backend.Float, 0.5)

    def run() -> None:
        dr.eval(dr.full(backend.Float, 1.0, count) * value)
        dr.sync_thread()

    return BYTES / _best(run)


def _best(run: Callable[[], None]) -> float:
    """Return the shortest of some runs' kernel times [s]: a peak is what the machine can do when nobody disturbs it."""
    run()
    return min(kernels(run)[0] for _ in range(REPETITIONS))
