"""The audit's worker processes: each takes whatever order comes."""

from typing import Any

from rayproof.reports.audit.mutants.trials import MutantOrder
from rayproof.reports.audit.orders import CaseOrder, GradedOrder, GuardOrder, LiarOrder
from rayproof.reports.processes.worker import serve
from rayproof.reports.run.llvm import choose_packaged_llvm


def serve_audit(kind: str, connection: Any) -> None:
    """Answer orders until the other end closes."""
    choose_packaged_llvm()
    serve(kind, connection, handlers=lambda _: work)


def work(order: CaseOrder | GuardOrder | GradedOrder | LiarOrder | MutantOrder) -> Any:
    """Do one order and return its report."""
    from rayproof.reports.audit import case_task, graded_task, guard_task, liar
    from rayproof.reports.audit.mutants import trials

    if isinstance(order, CaseOrder):
        return case_task.work(order)
    if isinstance(order, GuardOrder):
        return guard_task.work(order)
    if isinstance(order, LiarOrder):
        return liar.work(order)
    if isinstance(order, MutantOrder):
        return trials.work(order)
    return graded_task.work(order)
