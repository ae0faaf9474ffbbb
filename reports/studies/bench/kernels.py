"""What Dr.Jit says of a run's kernels: how long they ran, over how many lanes, and their code."""

from collections.abc import Callable
from dataclasses import dataclass

import drjit as dr


@dataclass(frozen=True, kw_only=True)
class Kernel:
    """One kernel of a run."""

    seconds: float
    lanes: int  # how often its code runs
    operations: int  # in its code, as Dr.Jit counts them: literals and memory too
    code: str  # as the backend's compiler gets it
    shares: tuple[float, ...] = ()  # of its packets that take each branch, where it was counted


def kernels(run: Callable[[], None]) -> tuple[Kernel, ...]:
    """Return the kernels of one more run."""
    before = dr.flag(dr.JitFlag.KernelHistory)
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    try:
        dr.kernel_history_clear()
        run()
        found = dr.kernel_history([dr.KernelType.JIT])
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, before)
    return tuple(
        Kernel(
            seconds=one["execution_time"] * 1e-3,
            lanes=one["size"],
            operations=one["operation_count"],
            code=one["ir"].getvalue(),
        )
        for one in found
    )


def fastest(run: Callable[[], None], *, times: int) -> tuple[Kernel, ...]:
    """Return the kernels of the fastest of some runs: what the machine can do when nobody disturbs it."""
    return min((kernels(run) for _ in range(times)), key=lambda found: sum(one.seconds for one in found))
