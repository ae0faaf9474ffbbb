"""An audit from request to score: plant, choose cases, let workers look, follow up what survived, add up."""

import json
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from rayproof.cases.case import Case
from rayproof.cases.families import all_cases, select
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Reply
from rayproof.reports.results.files import write_text
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.plan import plan
from rayproof.reports.terminal import console as terminal
from rayproof.tracer.kernel.compiler import choose_packaged_llvm
from tests.harness.audit import findings
from tests.harness.audit.findings import show
from tests.harness.audit.orders import (
    CaseOrder,
    CaseReport,
    GradedOrder,
    GradedReport,
    GuardOrder,
    LiarOrder,
    LiarReport,
    Sighting,
)
from tests.harness.audit.planted import LIAR, Assignment, PlantedFault, first_round, later_round, planted
from tests.harness.audit.records import AuditRecord, FaultFinding
from tests.harness.audit.tasks import QUANTITIES
from tests.harness.audit.worker import serve_audit

FAMILIES, QUICK_FAMILIES = 6, 3  # cases that a fault is put to at first, each of another family
GRADED_CASE = "primitives/sphere"
# What a liar is let loose on: shadows, several lights, surfaces and lights that coincide, mirrors, whatever is random.
LIAR_CASES = ("acne/*", "nearest/*", "primitives/*", "several_lights/*", "shadows/*", "transforms/*_mirrored")
QUICK_LIAR_CASES = ("acne/light_on_a_blocker", "nearest/coincident", "shadows/every_blocker")
LIAR_EPSILON = 0.05  # m, of eye and shadow rays: what a liar declares to hide behind, on the few cases
GRADES = tuple(10.0 ** (-half / 2) for half in range(4, 15))  # half decades from 1e-2 to 1e-7, relative
QUICK_GRADES = GRADES[::2]
MORE, QUICK_MORE = 12, 3  # further cases a round for what no case has killed at its own stage
NAME = "audit.json"
CHUNK = 30  # faults an order: one that kills a worker must not cost too much


@dataclass(frozen=True, kw_only=True)
class AuditRequest:
    """What a user asks of an audit. `only` is a glob over the faults' names, or a place such as "tracer"."""

    out: Path
    only: str
    quick: bool  # fewer families a fault at first, and fewer grades
    jobs: int  # worker processes at once
    timeout: float  # s, for one order
    json: Path | None  # where to copy audit.json


def run(request: AuditRequest) -> int:
    """Run the audit, write audit.json and print the score; return 0 if everything planted is found, else 1.

    Raises:
        LookupError: `only` names no fault.

    """
    choose_packaged_llvm()
    start = time.perf_counter()
    console = terminal()
    faults = planted(request.only)
    console.print(f"PLANTED FAULTS: {len(faults)}, one at a time; what fails here fails on purpose", style="bold red")
    audit = _Audit(request, console)
    try:
        entries = audit.entries(faults)
        graded = audit.graded() if request.only == "*" else []
        lies = audit.lies() if request.only in ("*", LIAR) else []
    finally:
        audit.close()
    result: AuditRecord = {
        "schema": 1,
        "quick": request.quick,
        "only": request.only,
        "seconds": round(time.perf_counter() - start, 1),
        "survived_at_first": audit.at_first,
        **findings.score(entries, audit.healthy, graded, audit.errors, lies),
    }
    text = json.dumps(result, indent=1, allow_nan=False) + "\n"
    request.out.mkdir(parents=True, exist_ok=True)
    write_text(request.out / NAME, text)
    if request.json is not None:
        write_text(request.json, text)
    show(console, result)
    console.print(f"{request.out / NAME}", soft_wrap=True)
    return 0 if result["good"] else 1


def _unjudged(sighting: Sighting) -> bool:
    """Say whether a case could not say anything about a fault."""
    return sighting.outcome is Outcome.ERROR and sighting.blamed is None


class _Audit:
    """The workers of one audit and what they saw."""

    def __init__(self, request: AuditRequest, console: Console) -> None:
        self.healthy: list[Sighting] = []
        self.errors: list[str] = []
        self._request, self._console = request, console
        self._cases = {case.name: case for case in all_cases() if case.samples == 1}
        self._pool = Pool(
            jobs=request.jobs, timeout=request.timeout, copies={"audit": request.jobs}, target=serve_audit
        )
        self._sightings: dict[str, list[Sighting]] = defaultdict(list)
        self._checked: set[str] = set()
        self._count = 0
        self.at_first: list[str] = []  # what survived the first round

    def close(self) -> None:
        """Stop the workers."""
        self._pool.close()

    def entries(self, faults: Sequence[PlantedFault]) -> list[FaultFinding]:
        """Return what is to be said of each fault."""
        guarded = [fault for fault in faults if ORACLE in fault.who]
        families = QUICK_FAMILIES if self._request.quick else FAMILIES
        self._judge_cases(first_round(faults, list(self._cases.values()), families=families))
        stopped: dict[str, str | None] = {}

        def guard_done(fault: PlantedFault, reply: Reply) -> None:
            stopped[fault.name] = reply.value.stopped if reply.error is None else None
            if reply.error is not None:
                self.errors.append(f"{fault.name}: {reply.error}")
            self.say(f"{fault.name}: {stopped[fault.name] or reply.error or 'survives'}")

        for fault in guarded:
            done = lambda reply, fault=fault: guard_done(fault, reply)  # noqa: E731
            self._submit(GuardOrder(fault=fault), done)
        self._drain()
        self.at_first = [fault.name for fault in self._unsettled(faults)]
        while unsettled := self._unsettled(faults):
            seen = {name: {one.case for one in some} for name, some in self._sightings.items()}
            more = later_round(
                unsettled, list(self._cases.values()), seen, most=QUICK_MORE if self._request.quick else MORE
            )
            if not more:
                break
            names = ", ".join(fault.name for fault in unsettled)
            self._console.print(f"not killed at its own stage so far: {names}", soft_wrap=True)
            self._judge_cases(more)
            self._drain()
        return [findings.by_cases(fault, self._sightings[fault.name], stopped.get(fault.name)) for fault in faults]

    def graded(self) -> list[GradedReport]:
        """Return what each stage can see of small errors."""
        reports: list[GradedReport] = []

        def done(reply: Reply) -> None:
            if reply.error is None:
                reports.append(reply.value)
                self.say(f"graded {reply.value.quantity}, {reply.value.precision}")
            else:
                self.errors.append(f"graded faults: {reply.error}")

        amounts = QUICK_GRADES if self._request.quick else GRADES
        for quantity in QUANTITIES:
            for precision in ("float32", "float64"):
                case = self._cases[GRADED_CASE]
                order = GradedOrder(case=case, quantity=quantity, precision=precision, amounts=amounts)
                self._submit(order, done)
        self._drain()
        return sorted(reports, key=lambda report: (QUANTITIES.index(report.quantity), report.precision))

    def lies(self) -> list[LiarReport]:
        """Return what a liar could spoil of each case, without an epsilon and behind one."""
        reports: list[LiarReport] = []

        def done(reply: Reply) -> None:
            if reply.error is None:
                reports.append(reply.value)
                self.say(f"liar, {reply.value.case}: {reply.value.unseen} of {reply.value.pixels} unseen")
            else:
                self.errors.append(f"liar: {reply.error}")

        few = [case for case in select(QUICK_LIAR_CASES) if case.samples == 1]
        cases = few if self._request.quick else [case for case in select(LIAR_CASES) if case.samples == 1]
        for epsilon, some in ((0.0, cases), (LIAR_EPSILON, few)):
            for case in some:
                self._submit(LiarOrder(case=case, epsilon=epsilon), done)
        self._drain()
        return sorted(reports, key=lambda report: report.case)

    def _unsettled(self, faults: Sequence[PlantedFault]) -> list[PlantedFault]:
        """Return the faults that no case has killed at their own stage yet, and that are not proven to be right."""
        return [
            fault
            for fault in faults
            if fault.equivalent is None
            and not any(findings.kills(fault, one) and one.stage is fault.stage for one in self._sightings[fault.name])
        ]

    def _judge_cases(self, assignment: Assignment) -> None:
        """Order every case of an assignment, the unchanged tracer with it the first time."""
        for name, faults in sorted(assignment.items()):
            case = self._cases[name]
            for first in range(0, len(faults), CHUNK):
                healthy = () if name in self._checked else self._configurations(case)
                self._checked.add(name)
                self._submit(
                    CaseOrder(case=case, faults=tuple(faults[first : first + CHUNK]), healthy=healthy),
                    self._case_done(case),
                )

    def _configurations(self, case: Case) -> tuple[str, ...]:
        return plan((case,), ())[0].configurations

    def _case_done(self, case: Case) -> Callable[[Reply], None]:
        def done(reply: Reply) -> None:
            if reply.error is not None:
                self.errors.append(f"{case.name}: {reply.error}")
                self.say(f"{case.name}: {reply.error}")
                return
            report: CaseReport = reply.value
            for one in report.sightings:
                self._sightings[one.fault].append(one)
            self.healthy += report.healthy
            self.errors += [f"{one.fault}, {one.case}: {one.reason}" for one in report.sightings if _unjudged(one)]
            found = sum(one.blamed is not None for one in report.sightings)
            self.say(f"{case.name}: {found} of {len(report.sightings)} faults show ({reply.seconds:.1f} s)")

        return done

    def _submit(self, order: Any, done: Callable[[Reply], None]) -> None:
        self._pool.submit("audit", order).add_done_callback(lambda future: done(future.result()))

    def _drain(self) -> None:
        while not self._pool.idle:
            self._pool.step()

    def say(self, line: str) -> None:
        """Print a line of progress."""
        self._count += 1
        self._console.print(f"{self._count:4} {line}", soft_wrap=True)
