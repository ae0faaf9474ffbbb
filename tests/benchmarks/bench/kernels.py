"""The kernels of a run: their time, their lanes, and the arithmetic in the branches of their code that packets take."""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import drjit as dr
import numpy as np


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


# How much of a kernel's code its packets run: the branches that the code has, and how many packets take each.


BRANCH = re.compile(r"^l_(\d+)_(t|next):", re.MULTILINE)  # where one begins, and where it has ended
PACKET = re.compile(r"<(\d+) x i1>")


def count(code: str) -> int:
    """Return the number of branches."""
    return sum(kind == "t" for _, kind in BRANCH.findall(code))


def parts(code: str, shares: Sequence[float]) -> Iterator[tuple[float, str]]:
    """Yield the code piece by piece, each with the share of the packets that run it; `shares` has one per branch."""
    running, begun, rest = [1.0], 0, iter(shares)
    for found in BRANCH.finditer(code):
        yield running[-1], code[begun : found.start()]
        begun = found.start()
        if found[2] == "t":
            running.append(next(rest))
        else:
            running.pop()
    yield running[-1], code[begun:]


def _share(lanes: np.ndarray, kernel: Kernel) -> float:
    """Return the share of a kernel's packets in which some lane is true."""
    found = PACKET.search(kernel.code)
    width = int(found[1]) if found else 1
    every = np.broadcast_to(lanes, (kernel.lanes,))
    return float(np.pad(every, (0, -kernel.lanes % width)).reshape(-1, width).any(axis=1).mean())


def shared(kernels: Sequence[Kernel], asked: Sequence[np.ndarray]) -> tuple[Kernel, ...]:
    """Return the kernels with the share of packets that take each branch; `asked` says which lanes ask, (lanes,) bool.

    They are as they were where the code has other branches than were asked about.
    """
    if sum(count(kernel.code) for kernel in kernels) != len(asked):
        return tuple(kernels)
    rest = iter(asked)
    return tuple(
        replace(kernel, shares=tuple(_share(next(rest), kernel) for _ in range(count(kernel.code))))
        for kernel in kernels
    )


# The arithmetic that a kernel's code asks for in every lane, read from LLVM's text.
#
# Only what must reach a vector unit counts. A literal, a cast, a sign that is turned and the logic of masks may
# vanish in other instructions; a comparison vanishes in a choice of one of its own operands, a minimum or maximum.


LOOP = re.compile(r"^l_\d+_cond:", re.MULTILINE)
VALUE = r"<\d+ x (float|double)> "
OPERATION = re.compile(
    rf"= (?:fadd|fsub|fmul|call <\d+ x \w+> @llvm\.(?:fma|minimum|maximum|minnum|maxnum)\S*?\() ?{VALUE}"
)
COMPARISON = re.compile(rf"(%\w+) = fcmp \w+ {VALUE}(%\w+), (%\w+)")
CHOICE = re.compile(rf"= select <\d+ x i1> (%\w+), {VALUE}(%\w+), <\d+ x \w+> (%\w+)")
DIVISION = re.compile(rf"= fdiv {VALUE}")
ROOT = re.compile(r"= call <\d+ x (float|double)> @llvm\.sqrt")
PRECISIONS = {"float": "float32", "double": "float64"}


@dataclass(frozen=True, kw_only=True)
class Work:
    """Instructions of one precision in the code of one kernel, per lane."""

    operations: float  # sums, products, fused ones, comparisons and choices
    divisions: float
    roots: float


def loops(code: str) -> bool:
    """Return whether some of the code may run more than once a lane."""
    return LOOP.search(code) is not None


def _counts(code: str) -> tuple[Counter[str], Counter[str], Counter[str]]:
    """Return the operations, divisions and roots of each kind of number in some code without branches."""
    operations = Counter(OPERATION.findall(code))
    compared = {name: (kind, {one, other}) for name, kind, one, other in COMPARISON.findall(code)}
    absorbed = set()
    for name, kind, one, other in CHOICE.findall(code):
        operations[kind] += 1
        if name in compared and compared[name][1] == {one, other}:
            absorbed.add(name)
    operations.update(kind for name, (kind, _) in compared.items() if name not in absorbed)
    return operations, Counter(DIVISION.findall(code)), Counter(ROOT.findall(code))


def work(code: str, shares: Sequence[float] = ()) -> dict[str, Work]:
    """Return the instructions of each precision in the code; what stands in a branch counts by the share that runs."""
    found = {kind: [0.0, 0.0, 0.0] for kind in PRECISIONS}
    for share, part in parts(code, shares):
        for place, counts in enumerate(_counts(part)):
            for kind in PRECISIONS:
                found[kind][place] += share * counts[kind]
    return {
        name: Work(operations=found[kind][0], divisions=found[kind][1], roots=found[kind][2])
        for kind, name in PRECISIONS.items()
    }
