"""How much of a kernel's code its packets run: the branches that the code has, and how many packets take each."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from rayproof.reports.studies.bench.kernels import Kernel

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
