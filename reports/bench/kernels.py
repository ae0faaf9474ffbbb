"""What Dr.Jit says of a run's kernels: how long they ran, how many operations their code has."""

from collections.abc import Callable

import drjit as dr


def kernels(run: Callable[[], None]) -> tuple[float, int]:
    """Return the seconds that the kernels of one more run took, and the number of operations in their code."""
    before = dr.flag(dr.JitFlag.KernelHistory)
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    try:
        dr.kernel_history_clear()
        run()
        found = dr.kernel_history([dr.KernelType.JIT])
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, before)
    return sum(one["execution_time"] for one in found) * 1e-3, sum(one["operation_count"] for one in found)
