"""What this machine can do at most (arithmetic, divisions, roots, bytes written), and how near kernels come to it."""

from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr

from rayproof.cases.scene import Scene
from tests.benchmarks.bench.kernels import Kernel, count, fastest, loops, work
from tests.benchmarks.bench.records import LimitRecord, MachineRecord, PeakRates

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


# How near kernels come to what the machine can do: the least time that it could need, over the time that they took.
#
# Three things take time, side by side at best: the vector units, which issue every sum, product, comparison and choice;
# the unit that divides and takes square roots, one unit in the processors of AMD and Intel (Fog, "Instruction tables");
# and the memory that the image is written to. No kernel can beat the slowest of them, and a rate that is measured by a
# loop of nothing else is what none exceeds.


PIXEL_BYTES = 12  # a pixel's three float32 channels


def limit(scene: Scene, kernels: Sequence[Kernel], machine: MachineRecord) -> LimitRecord | None:
    """Return `limit_fraction`, at most about 1, and `limit_by`, what sets it: "operations", "divisions" or "writes".

    `limit_sum_fraction` is by the sum of the three: a kernel at 1 does them one after the other, and only fewer of them
    would make it faster.

    None without a kernel, or with one that loops or whose branches nobody counted: how often its code runs is unknown.
    """
    seconds = sum(kernel.seconds for kernel in kernels)
    if not seconds > 0 or any(loops(kernel.code) or count(kernel.code) != len(kernel.shares) for kernel in kernels):
        return None
    least = {"operations": 0.0, "divisions": 0.0}
    peaks = {"float32": machine["float32"], "float64": machine["float64"]}
    for kernel in kernels:
        for precision, of in work(kernel.code, kernel.shares).items():
            rates = peaks[precision]
            least["operations"] += kernel.lanes * of.operations / rates["operations_per_second"]
            least["divisions"] += kernel.lanes * of.divisions / rates["divisions_per_second"]
            least["divisions"] += kernel.lanes * of.roots / rates["roots_per_second"]
    least["writes"] = scene.camera.width * scene.camera.height * PIXEL_BYTES / machine["write_bytes_per_second"]
    by = max(least, key=lambda name: least[name])
    together = sum(least.values()) / seconds
    return {"limit_fraction": least[by] / seconds, "limit_by": by, "limit_sum_fraction": together}
