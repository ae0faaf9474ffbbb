"""What a run found, as results.json has it."""

import platform
import sys
from collections.abc import Sequence
from datetime import datetime
from importlib.metadata import version
from typing import Any, cast

from rayproof.reports.results.json_numbers import legible
from rayproof.reports.results.outcomes import Outcome, worst
from rayproof.reports.results.records import CaseRecord, RunRecord
from rayproof.reports.run.panel import Panel
from rayproof.reports.run.plan import PlannedCase, configurations_of
from rayproof.reports.run.record import totals
from rayproof.reports.run.record.common_factors import wrong
from rayproof.reports.run.record.totals import Totals
from rayproof.reports.subjects import Subject


def results_document(
    planned: Sequence[PlannedCase],
    records: Sequence[CaseRecord],
    found: Totals,
    heard: Panel,
    faults: list[str],
    started: datetime,
    subject: Subject,
) -> RunRecord:
    """Return a run's document, as docs/results.md describes it; `found` is what its records come to."""
    from rayproof.reference import REFERENCES

    versions = found.versions
    environment = {"python": sys.version.split()[0], "machine": platform.machine(), "system": platform.platform()}
    return {
        "schema": 1,
        "rayproof": version("rayproof"),
        "command": " ".join(["rayproof", *sys.argv[1:]]),
        "started": started.isoformat(timespec="seconds"),
        "subject": subject.title,
        "faults": faults,
        "environment": environment | {name: text for name, text in versions.items() if name not in heard.names},
        "configurations": sorted(configurations_of(planned)),
        "references": {
            name: {
                "version": versions.get(name, "not asked"),
                "precision": REFERENCES[name].precision,
                "independent": bool(REFERENCES.about(name).get("independent", False)),
            }
            for name in heard.names
        },
        "absent": heard.absent,
        **come_to(found, planned=len(planned), tracer=subject.is_tracer),
        "cases": cast("list[CaseRecord]", records),
    }


def come_to(found: Totals, *, planned: int, tracer: bool) -> RunRecord:
    """Return what of a run's document its records come to: verdict, ledgers, coverage and what to look at."""
    detail = found.coverage
    pooled, wide = found.factors.pooled, found.factors.wide
    shared = wrong(pooled, wide)
    of_cases = found.verdict(planned=planned, tracer=tracer)
    told: Any = {
        "verdict": worst([of_cases, *(Outcome.FAIL for _ in (*shared, *found.changing))]).value,
        "abstained": found.abstained,
        "stopped": found.stopped,
        "summary": found.case_ledger(planned=planned),
        "checks": found.check_ledger(),
        "examined": found.examined,
        "examined_passing": found.examined_passing,
        "common_factors": pooled,
        "wide_limits": wide,
        "wrong_factors": shared,
        "changing": found.changing,
        "coverage": {item: entry["cases"] for item, entry in detail.items()},
        "coverage_detail": detail,
        "images_kept": {"cases": found.with_images, "left_out": found.without_images},
        "review": found.review,
        "findings": found.findings,
    }
    return told


def uncountable(record: CaseRecord) -> str | None:
    """Return in a line what keeps a record that somebody else wrote from being counted with a run's, or None."""
    try:
        come_to(totals.of((record,)), planned=1, tracer=True)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        return legible(f"{type(error).__name__}: {error}")
    return None
