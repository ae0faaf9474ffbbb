"""The arithmetic that a kernel's code asks for in every lane, read from LLVM's text.

Only what must reach a vector unit counts. A literal, a cast, a sign that is turned and the logic of masks may vanish in
other instructions; a comparison vanishes in a choice of one of its own operands, which is a minimum or a maximum.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from rayproof.reports.studies.bench.branches import parts

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
