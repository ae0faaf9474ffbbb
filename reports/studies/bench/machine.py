"""What this machine can do at most, measured as our kernels would: arithmetic, divisions, roots, and bytes written."""

from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr

from rayproof.reports.studies.bench.kernels import fastest
from rayproof.reports.studies.bench.records import MachineRecord, PeakRates

WIDTH = 2**16  # lanes: enough packets for every thread, few enough to stay in the caches
CHAIN = 64  # operations a lane, one after the other
# Independent chains: more than a latency of operations, and no more than there are registers. A float64 takes two.
CHAINS = (7, 14)
# The one unit that divides takes most of a latency for each packet: seven keep it busy, more only leave the registers.
DIVIDING = (7,)
BYTES = 2**26  # written at once: beyond every cache
REPETITIONS = 15

Step = Callable[[Any, Any], Any]


def _multiply_add(x: Any, y: Any) -> Any:
    return dr.fma(x, y, y)


def _add(x: Any, y: Any) -> Any:
    return x + y


def _divide(x: Any, y: Any) -> Any:
    return y / x


def _root(x: Any, y: Any) -> Any:
    return dr.sqrt(x)


def machine() -> MachineRecord:
    """Return the peaks: operations of either precision and bytes written a second; threads; Gflop/s as often quoted."""
    import drjit.llvm as backend

    single, double = _rate(backend.Float, [_multiply_add]), _rate(backend.Float64, [_multiply_add])
    return {
        "threads": dr.thread_count(),
        "fma_gflops": 2e-9 * single,
        "fma_float64_gflops": 2e-9 * double,
        "float32": _peaks(backend.Float, single),
        "float64": _peaks(backend.Float64, double),
        "write_bytes_per_second": _write_rate(backend),
    }


def _peaks(kind: Any, multiply_adds: float) -> PeakRates:
    return {
        # Some processors add beside the units that multiply, others do not.
        "operations_per_second": max(multiply_adds, _rate(kind, [_multiply_add, _add])),
        "divisions_per_second": _rate(kind, [_divide], DIVIDING),
        "roots_per_second": _rate(kind, [_root], DIVIDING),
    }


def _rate(kind: Any, steps: list[Step], counts: Sequence[int] = CHAINS) -> float:
    """Return how many operations, of these in turn, the machine does a second over all threads."""
    return max(WIDTH * chains * CHAIN / _best(_chained(kind, steps, chains)) for chains in counts)


def _chained(kind: Any, steps: list[Step], chains: int) -> Callable[[], None]:
    starts = [dr.opaque(kind, 1.0 + 0.125 * index, WIDTH) for index in range(chains)]
    factor = dr.opaque(kind, 0.999, WIDTH)

    def run() -> None:
        values = list(starts)
        for _ in range(CHAIN):
            values = [steps[index % len(steps)](value, factor) for index, value in enumerate(values)]
        total = values[0]
        for value in values[1:]:
            total = total + value
        dr.eval(total)
        dr.sync_thread()

    return run


def _write_rate(backend: Any) -> float:
    count = BYTES // 4
    value = dr.opaque(backend.Float, 0.5)

    def run() -> None:
        dr.eval(dr.full(backend.Float, 1.0, count) * value)
        dr.sync_thread()

    return BYTES / _best(run)


def _best(run: Callable[[], None]) -> float:
    """Return the shortest of some runs' kernel times [s]."""
    run()
    return sum(kernel.seconds for kernel in fastest(run, times=REPETITIONS))
