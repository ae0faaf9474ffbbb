"""What a run found, as results.json has it."""

import platform
import sys
from collections.abc import Sequence
from datetime import datetime
from importlib.metadata import version
from typing import cast

from rayproof.reports.paths.verdict import paths_of
from rayproof.reports.results.outcomes import Outcome, worst
from rayproof.reports.results.records import CaseRecord, RunRecord
from rayproof.reports.run.panel import Panel
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.record import totals
from rayproof.reports.run.record.common_factors import common_factors, wrong
from rayproof.reports.subjects import Subject


def results_document(
    planned: tuple[PlannedCase, ...],
    records: Sequence[CaseRecord],
    heard: Panel,
    faults: list[str],
    started: datetime,
    subject: Subject,
) -> RunRecord:
    """Return results.json's content, as docs/results.md describes it."""
    from rayproof.reference import REFERENCES

    versions: dict[str, str] = {}
    for record in records:
        versions |= record.get("versions", {})
    environment = {"python": sys.version.split()[0], "machine": platform.machine(), "system": platform.platform()}
    detail = totals.coverage(records)
    pooled = common_factors(records)
    shared = wrong(pooled)
    of_cases = totals.verdict(records, planned=len(planned), tracer=subject.is_tracer)
    return {
        "schema": 1,
        "rayproof": version("rayproof"),
        "command": " ".join(["rayproof", *sys.argv[1:]]),
        "started": started.isoformat(timespec="seconds"),
        "verdict": worst([of_cases, *(Outcome.FAIL for _ in shared)]).value,
        "subject": subject.title,
        "faults": faults,
        "environment": environment | {name: text for name, text in versions.items() if name not in heard.names},
        "configurations": sorted({name for one in planned for name in one.configurations}),
        "references": {
            name: {
                "version": versions.get(name, "not asked"),
                "precision": REFERENCES[name].precision,
                "independent": bool(REFERENCES.about(name).get("independent", False)),
            }
            for name in heard.names
        },
        "absent": heard.absent,
        "abstained": totals.abstained(records),
        "summary": totals.case_ledger(records, planned=len(planned)),
        "checks": totals.check_ledger(records),
        "examined": totals.examined(records),
        "examined_passing": totals.examined(records, outcome=Outcome.PASS),
        "common_factors": pooled,
        "wrong_factors": shared,
        "coverage": {item: entry["cases"] for item, entry in detail.items()},
        "coverage_detail": detail,
        "paths": paths_of(records),
        "review": totals.review(records),
        "findings": totals.findings(records),
        "cases": cast("list[CaseRecord]", records),
    }
