"""Putting the records of a run together: ledgers, coverage by specification item, limits to review."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any, cast

from rayproof.cases.case import ITEMS
from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.examined import Examined
from rayproof.reports.judge.panel.known_defects import known_findings
from rayproof.reports.judge.supported_stages import concerning
from rayproof.reports.results.json_numbers import at_worst
from rayproof.reports.results.outcomes import MEASURED, Outcome, ledger, worst
from rayproof.reports.results.records import CaseRecord, CheckRecord, CoverageRecord, LedgerRecord, ReviewRecord

LOW, HIGH = 0.01, 0.8  # a limit used less than this is slack, more than this is tight
STAGE_ITEMS: dict[str, tuple[str, ...]] = {
    "CAM": ("camera",),
    "CAM-4": ("ray",),
    "CAM-5": ("ray",),
    "XF": ("distance", "position", "normal"),
    "HIT": ("object", "distance"),
    "NRM": ("normal",),
    "LIT": ("visibility",),
    "RAD": ("irradiance", "exitance", "radiance"),
}


def check_ledger(records: Sequence[CaseRecord]) -> LedgerRecord:
    """Return the ledger of checks; raise ValueError if it does not add up to what the cases planned."""
    outcomes = [Outcome(check["verdict"]) for record in records for check in record["checks"]]
    return cast(LedgerRecord, ledger(outcomes, planned=sum(record["planned"] for record in records)))


def case_ledger(records: Sequence[CaseRecord], *, planned: int) -> LedgerRecord:
    """Return the ledger of cases; raise ValueError if it does not add up to the plan.

    Cases that an interrupted run did not reach were planned and are missing.
    """
    outcomes = [Outcome(record["verdict"]) for record in records]
    return cast(LedgerRecord, ledger(outcomes + [Outcome.MISSING] * (planned - len(outcomes)), planned=planned))


def examined(records: Iterable[CaseRecord], *, outcome: Outcome | None = None) -> dict[str, int]:
    """Return what the checks of all cases examined, pixel by pixel; with an outcome, the checks that ended in it."""
    total = dict.fromkeys(Examined(pixels=0).as_json(), 0)
    for record in records:
        for check in record["checks"]:
            if outcome is None or check["verdict"] == outcome.value:
                for name in total:
                    total[name] += (check["examined"] or {})[name]
    return Examined(**total).as_json()  # raises where the sums do not add up: each ledger did when it was made


def coverage(records: Iterable[CaseRecord]) -> dict[str, CoverageRecord]:
    """Return for each specification item how many cases measured it, how many failed, and how near to the limit.

    A case counts only if it says that it covers the item, a configuration ran whose formulas cover it, and a check at
    one of the item's stages measured something.
    """
    found: dict[str, dict[str, Any]] = {
        item: {"cases": 0, "failed": 0, "worst_ratio": 0.0, "worst_check": None, "references": set()} for item in ITEMS
    }
    for record in records:
        for item in record["covers"]:
            entry = found[item]
            stages = STAGE_ITEMS.get(item) or STAGE_ITEMS[item.split("-")[0]]
            measured = [
                check
                for check in record["checks"]
                if check["stage"] in stages
                and Outcome(check["verdict"]) in MEASURED
                and item in record["ran"].get(check["configuration"], ())
                and _exercised(item, check)
            ]
            if not measured:
                continue
            entry["cases"] += 1
            entry["failed"] += any(check["verdict"] == Outcome.FAIL.value for check in measured)
            for check in measured:
                entry["references"].add(check["reference"])
                ratio = at_worst(check["ratio"])
                if ratio > at_worst(entry["worst_ratio"]) or entry["worst_check"] is None:
                    entry["worst_ratio"] = check["ratio"]
                    entry["worst_check"] = _name(record, check)
    for entry in found.values():
        entry["references"] = sorted(entry["references"])
    return cast("dict[str, CoverageRecord]", found)


def _exercised(item: str, check: CheckRecord) -> bool:
    """Say whether the check met the item at all: where nothing is hit nothing is turned, lit or seen.

    A miss tells of hit tests and cameras as much as a hit does.
    """
    if item.split("-")[0] in ("CAM", "HIT"):
        return True
    measured = check.get("end_to_end")
    return measured is None or measured["interior"] > 0


def review(records: Iterable[CaseRecord]) -> list[ReviewRecord]:
    """Return the limits to look at again: slack in all cases of a kind, or tight in one."""
    groups: dict[tuple[str, str, str], list[tuple[float, str]]] = {}
    for record in records:
        for check in record["checks"]:
            # Integers are equal or not: their limit is 0 and cannot be slack.
            if check["stage"] in (Stage.OBJECT, Stage.VISIBILITY) or Outcome(check["verdict"]) not in MEASURED:
                continue
            key = (check["configuration"], check["reference"], check["stage"])
            groups.setdefault(key, []).append((at_worst(check["ratio"]), _name(record, check)))
    listed = []
    for ratios in groups.values():
        highest, name = max(ratios)
        if highest < LOW:
            listed.append({"check": name, "ratio": highest, "why": f"below {LOW} in all {len(ratios)} cases"})
        listed += [
            {"check": name, "ratio": ratio, "why": f"above {HIGH}"} for ratio, name in ratios if HIGH < ratio <= 1
        ]
    return sorted(listed, key=lambda entry: -at_worst(entry["ratio"]))


def findings(records: Iterable[CaseRecord]) -> list[dict[str, Any]]:
    """Return the checked-in findings about references, each with the checks of this run that it explained."""
    met: dict[str, list[str]] = {}
    for record in records:
        for check in record["checks"]:
            if finding := check.get("finding"):
                met.setdefault(finding, []).append(_name(record, check))
    return [asdict(entry) | {"met": met.get(entry.name, [])} for entry in known_findings()]


def verdict(records: Sequence[CaseRecord], *, planned: int, tracer: bool = True) -> Outcome:
    """Return the run's verdict: its worst case's; a case that was not reached is missing.

    Of another subject than the tracer those cases count that it supports.
    """
    outcomes = concerning((Outcome(record["verdict"]) for record in records), tracer=tracer)
    return worst(outcomes + [Outcome.MISSING] * (planned - len(records)))


def abstained(records: Iterable[CaseRecord]) -> dict[str, dict[str, str]]:
    """Return each reference that had no say in a case where it was planned, by a crash or a time limit: case to why."""
    found: dict[str, dict[str, str]] = {}
    for record in records:
        for name, why in record.get("abstained", {}).items():
            found.setdefault(name, {})[record["name"]] = why
    return found


def silent(records: Iterable[CaseRecord], required: Iterable[str]) -> tuple[str, ...]:
    """Return the required references that measured nothing in any case."""
    heard = {
        check["reference"] for record in records for check in record["checks"] if Outcome(check["verdict"]) in MEASURED
    }
    return tuple(name for name in dict.fromkeys(required) if name not in heard)


def _name(record: CaseRecord, check: CheckRecord) -> str:
    return f"{record['name']} {check['configuration']} {check['reference']} {check['stage']}"
