"""Many laws on many cases: orders to workers, reports back, and what all of them say of each law."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypedDict

from rayproof.cases.case import Case
from rayproof.cases.laws import LAWS
from rayproof.cases.stages import Stage
from rayproof.reports.laws.judging import Judged
from rayproof.reports.laws.law_task import serve_laws
from rayproof.reports.laws.orders import LawOrder, LawReport
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Reply
from rayproof.reports.subjects import Subject

PASS, FAIL, ERROR, UNSUPPORTED, SILENT = "pass", "fail", "error", "unsupported", "inapplicable"
WORST_LAST = (SILENT, UNSUPPORTED, PASS, ERROR, FAIL)
KIND = "laws"


class LawAlarm(TypedDict):
    """A relation that is broken on a case; expected and measured are values of its stage at the worst pixel."""

    case: str
    configuration: str
    stage: str
    what: str
    pixel: list[int] | None  # column and row
    expected: list[float]
    measured: list[float]
    outside: int  # pixels
    excused: int  # pixels
    examined: int  # pixels
    worst_over_Ku: float


class LawFinding(TypedDict):
    """What the relations of one law came to, over all cases."""

    law: str
    stage: str
    anchor: bool
    implicates: list[str]  # the specification's items
    cases: list[str]
    relations: int
    ill_conditioned: int  # relations
    pixels: int
    excused: int
    worst_over_Ku: float
    verdict: str
    alarms: list[LawAlarm]
    problems: list[str]
    unsupported: list[str]  # the subject's reasons


class LawsRecord(TypedDict):
    """What `rayproof laws --json` writes."""

    schema: int
    finished: bool
    subject: str
    configurations: list[str]
    stages: list[str]
    pairs: int  # of a law and a case
    laws: list[LawFinding]
    relations: int
    alarms: int
    errors: int
    scenes: int  # rendered
    seconds: float


@dataclass(frozen=True, kw_only=True)
class Pair:
    """One law on one case."""

    law: str
    case: Case


@dataclass(frozen=True, kw_only=True)
class LawsRequest:
    """What is asked of `rayproof laws`."""

    subject: Subject
    configurations: tuple[str, ...]
    pairs: tuple[Pair, ...]
    stages: tuple[Stage, ...]
    jobs: int
    timeout: float  # s, of one law on one case
    keep: bool = False


def run(request: LawsRequest, done: Callable[[LawReport, float], None]) -> None:
    """Put every pair to the subject; `done` hears each report and its seconds as it comes."""
    pool = Pool(jobs=request.jobs, timeout=request.timeout, copies={KIND: request.jobs}, target=serve_laws)
    try:
        for configuration in request.configurations:
            for pair in request.pairs:
                order = LawOrder(
                    law=pair.law,
                    case=pair.case.name,
                    scene=pair.case.scene,
                    subject=request.subject,
                    configuration=configuration,
                    stages=request.stages,
                    keep=request.keep,
                )

                def heard(reply: Reply, order: LawOrder = order) -> None:
                    report = reply.value or LawReport(
                        law=order.law, case=order.case, configuration=order.configuration, error=reply.error
                    )
                    done(report, reply.seconds)

                pool.submit(KIND, order, heard)
        while not pool.idle:
            pool.step()
    finally:
        pool.close()


def verdict(report: LawReport) -> str:
    """Return what one report comes to."""
    if report.error is not None:
        return ERROR
    if report.unsupported is not None:
        return UNSUPPORTED
    if report.alarms:
        return FAIL
    return PASS if any(one.examined for one in report.judged) else SILENT


def summary(reports: Iterable[LawReport]) -> list[LawFinding]:
    """Return a row for each law, in alphabetical order: what its relations came to."""
    by_law: dict[str, list[LawReport]] = {}
    for report in reports:
        by_law.setdefault(report.law, []).append(report)
    return [_row(law, some) for law, some in sorted(by_law.items())]


def _row(law: str, reports: Sequence[LawReport]) -> LawFinding:
    judged = [one for report in reports for one in report.judged]
    verdicts = [verdict(report) for report in reports]
    about = LAWS.about(law)
    return {
        "law": law,
        "stage": str(about["stage"]),
        "anchor": bool(about.get("anchor", False)),
        "implicates": list(about["implicates"]),
        "cases": sorted({report.case for report in reports}),
        "relations": sum(one.examined > 0 for one in judged),
        "ill_conditioned": sum(one.ill_conditioned for one in judged),
        "pixels": sum(one.examined for one in judged),
        "excused": sum(one.excused for one in judged),
        "worst_over_Ku": max((one.worst for one in judged), default=0.0),
        "verdict": max(verdicts, key=WORST_LAST.index),
        "alarms": [_alarm(report, one) for report in reports for one in report.alarms],
        "problems": sorted({f"{one.case}: {one.error}" for one in reports if one.error is not None}),
        "unsupported": sorted({one.unsupported for one in reports if one.unsupported is not None}),
    }


def _alarm(report: LawReport, one: Judged) -> LawAlarm:
    return {
        "case": report.case,
        "configuration": report.configuration,
        "stage": str(one.stage),
        "what": one.what,
        "pixel": list(one.pixel) if one.pixel else None,
        "expected": list(one.expected),
        "measured": list(one.measured),
        "outside": one.outside,
        "excused": one.excused,
        "examined": one.examined,
        "worst_over_Ku": one.worst,
    }


def document(
    request: LawsRequest, reports: Sequence[LawReport], seconds: float, *, finished: bool = True
) -> LawsRecord:
    """Return what `--json` writes."""
    rows = summary(reports)
    return {
        "schema": 1,
        "finished": finished,
        "subject": request.subject.title,
        "configurations": list(request.configurations),
        "stages": [str(stage) for stage in request.stages],
        "pairs": len(request.pairs),
        "laws": rows,
        "relations": sum(row["relations"] for row in rows),
        "alarms": sum(len(row["alarms"]) for row in rows),
        "errors": sum(report.error is not None for report in reports),
        "scenes": sum(report.scenes for report in reports),
        "seconds": round(seconds, 1),
    }


def exit_code(content: LawsRecord) -> int:
    """Return 1 if a law is broken, 3 if one could not be asked or nothing was measured, else 0."""
    if content["alarms"]:
        return 1
    return 3 if content["errors"] or not content["relations"] else 0
