"""One fault before the guards: sentinels of the judge, and known questions to loader, ledgers and journal."""

from collections.abc import Callable
from functools import cache

from rayproof.reference.analytic import Analytic
from rayproof.reports.audit.faults import FAULTS
from rayproof.reports.audit.orders import GuardOrder, GuardReport


def work(order: GuardOrder) -> GuardReport:
    """Plant the order's fault, ask every guard, and say which one stopped the run."""
    _in_force()  # a guard that stops a healthy harness proves nothing
    with FAULTS[order.fault.name]():
        return GuardReport(fault=order.fault.name, stopped=stopped_by(judge_first=order.fault.where == "judge"))


@cache
def _in_force() -> None:
    """Ask every guard with nothing planted; raise RuntimeError if one cries."""
    if cry := stopped_by():
        raise RuntimeError(f"nothing is planted, and yet: {cry}")


def stopped_by(*, judge_first: bool = False) -> str | None:
    """Return what the first guard says that stops the run, or None; a run asks all of them, in whatever order."""
    from rayproof.reports.judge.self_test.stand_guard import BrokenJudgeError, stand_guard
    from rayproof.reports.run.guards import BrokenHarnessError, stand_guards

    guards: tuple[Callable[[], object], ...] = (stand_guards, lambda: stand_guard(Analytic()))
    for guard in guards[::-1] if judge_first else guards:
        try:
            guard()
        except (BrokenHarnessError, BrokenJudgeError) as cry:
            return str(cry)
    return None
