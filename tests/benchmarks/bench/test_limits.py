"""The limit is one: no kernel of any machine is faster, whatever the machine's rates are."""

# pyright: reportArgumentType=false, reportOperatorIssue=false, reportOptionalOperand=false, reportReturnType=false
# Records are incomplete on purpose.

import dataclasses
from typing import Any

import drjit as dr
import pytest

from rayproof.cases.benchmark_scenes import chosen
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import Frames
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.plan import Plan
from tests.benchmarks.bench.kernels import Kernel, Work, kernels, shared, work
from tests.benchmarks.bench.limits import CHAIN, WIDTH, _add, _chained, _divide, _multiply_add, _root, limit

pytestmark = pytest.mark.skipif(not dr.has_backend(dr.JitBackend.LLVM), reason="Dr.Jit finds no LLVM library")

SIDE = 64  # px
RATES = {"operations_per_second": 4e9, "divisions_per_second": 1e9, "roots_per_second": 5e8}
MACHINE: dict[str, Any] = {"float32": RATES, "float64": RATES, "write_bytes_per_second": 1e12}


def scene(name: str = "sphere_and_floor"):
    return chosen((name,), quick=False)[0].scene(SIDE, SIDE)


def frame(precision: str, *, columns: int = 1) -> tuple[Kernel, ...]:
    """Return the kernels of one frame."""
    frames = Frames(scene(), Configuration(precision=precision), chosen=Plan(columns=columns))
    return shared(kernels(frames), frames.asked())


def in_line(found: tuple[Kernel, ...]) -> float:
    """Return the time [s] of a processor with MACHINE's rates that does nothing at the same time as anything else."""
    return sum(
        kernel.lanes * (of.operations / 4e9 + of.divisions / 1e9 + of.roots / 5e8)
        for kernel in found
        for of in work(kernel.code, kernel.shares).values()
    )


@pytest.mark.parametrize(
    ("step", "expected"),
    [
        (_multiply_add, Work(operations=7 * CHAIN, divisions=0, roots=0)),
        (_divide, Work(operations=0, divisions=7 * CHAIN, roots=0)),
        (_root, Work(operations=0, divisions=0, roots=7 * CHAIN)),
        (lambda x, y: dr.select(x < y, x, y), Work(operations=7 * CHAIN, divisions=0, roots=0)),  # a minimum
        (lambda x, y: dr.select(x < y, y, 1), Work(operations=2 * 7 * CHAIN, divisions=0, roots=0)),
        (lambda x, y: -dr.fma(-x, y, y), Work(operations=7 * CHAIN, divisions=0, roots=0)),  # signs are for nothing
    ],
    ids=["fma", "divide", "root", "minimum", "choice", "signs"],
)
def test_the_code_is_counted_instruction_by_instruction(step, expected: Work, precision: str) -> None:
    (kernel,) = kernels(_chained(array_types(precision).Float, [step], 7))

    found = work(kernel.code)[precision]
    assert kernel.lanes == WIDTH
    # Six additions take the chains together.
    assert dataclasses.replace(found, operations=found.operations - 6) == expected


def test_a_kernel_at_the_measured_rate_is_at_the_limit() -> None:
    (kernel,) = kernels(_chained(array_types("float32").Float, [_multiply_add, _add], 14))
    count = WIDTH * 14 * CHAIN
    peaks = {**MACHINE, "float32": {**RATES, "operations_per_second": count / kernel.seconds}}

    found = limit(scene(), [kernel], peaks)

    assert found is not None
    assert found["limit_by"] == "operations"
    assert found["limit_fraction"] == pytest.approx(1, rel=14 / (14 * CHAIN))


@pytest.mark.parametrize("columns", [1, 4])
def test_no_frame_is_faster_than_its_limit(columns: int, precision: str) -> None:
    found = frame(precision, columns=columns)
    # A processor that does everything side by side needs at least as long as the slowest of its units.
    work_of_each = [(kernel.lanes, of) for kernel in found for of in work(kernel.code, kernel.shares).values()]
    operations = sum(lanes * of.operations for lanes, of in work_of_each) / 4e9
    dividing = sum(lanes * (of.divisions / 1e9 + of.roots / 5e8) for lanes, of in work_of_each)
    ideal = _lasting(found, max(operations, dividing))

    best, usual = limit(scene(), ideal, MACHINE), limit(scene(), _lasting(found, in_line(found)), MACHINE)

    assert best is not None
    assert usual is not None
    assert best["limit_fraction"] == pytest.approx(1)
    assert 0.5 <= usual["limit_fraction"] < 1
    # What does one after the other is at the sum.
    assert usual["limit_sum_fraction"] == pytest.approx(1, rel=0.02)


def _lasting(found: tuple[Kernel, ...], seconds: float) -> tuple[Kernel, ...]:
    return tuple(dataclasses.replace(kernel, seconds=seconds / len(found)) for kernel in found)


def test_the_slowest_of_the_three_is_the_limit() -> None:
    found = _lasting(frame("float32"), 1.0)

    def by(**faster: float) -> str:
        peaks = {**MACHINE, "float32": {**RATES, **faster}}
        return (limit(scene(), found, peaks) or {})["limit_by"]

    assert by(operations_per_second=1e6) == "operations"
    assert by(divisions_per_second=1e6) == "divisions"
    assert by(roots_per_second=1e6) == "divisions"
    assert by(operations_per_second=1e15, divisions_per_second=1e15, roots_per_second=1e15) == "writes"
