"""The audit's worker processes: each takes whatever order comes."""

from typing import Any

from rayproof.reports.processes.worker import serve
from rayproof.tracer.kernel.compiler import choose_packaged_llvm
from tests.harness.audit.orders import CaseOrder, GradedOrder, GuardOrder, LiarOrder


def serve_audit(kind: str, connection: Any) -> None:
    """Answer orders until the other end closes."""
    choose_packaged_llvm()
    serve(kind, connection, handlers=lambda _: work)


def work(order: CaseOrder | GuardOrder | GradedOrder | LiarOrder) -> Any:
    """Do one order and return its report."""
    from tests.harness.audit import liar, tasks

    if isinstance(order, CaseOrder):
        return tasks.judge_faults(order)
    if isinstance(order, GuardOrder):
        return tasks.ask_guard(order)
    if isinstance(order, LiarOrder):
        return liar.lie(order)
    return tasks.grade(order)
