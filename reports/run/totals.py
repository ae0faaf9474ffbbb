"""A run's results from its records: counts, coverage by item, limits to review."""

import platform
import shlex
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from datetime import datetime
from importlib.metadata import version
from typing import Any, cast

from rayproof.cases.case import ITEMS
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.judge.known_defects import known_findings
from rayproof.reports.results.case_records import (
    CaseRecord,
    Check,
    Examined,
)
from rayproof.reports.results.files import SCHEMA, at_worst, legible
from rayproof.reports.results.images import keeps_images
from rayproof.reports.results.outcomes import MEASURED, Outcome, concerning, ledger, worst
from rayproof.reports.results.records import (
    AnsweredRecord,
    CoverageRecord,
    DeclaredRecord,
    FindingRecord,
    LedgerRecord,
    ReviewRecord,
    RunRecord,
)
from rayproof.reports.run.case_record import DECLARABLE
from rayproof.reports.run.plan import Panel, PlannedCase, configurations_of
from rayproof.reports.run.pooled_factors import PooledFactors, wrong
from rayproof.reports.subjects import Subject

LOW, HIGH = 0.01, 0.8  # a limit used less than this is slack, more than this is tight
LISTED = 1000  # limits to review, and checks that a finding explained: a long run has many alike
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


class Totals:
    """The totals of a run's records, which are added one at a time and not stored."""

    def __init__(self) -> None:
        self.cases: Counter[Outcome] = Counter()
        self.checks: Counter[Outcome] = Counter()
        self.planned_checks = 0
        self.abstained: dict[str, dict[str, str]] = {}  # reference -> case -> reason of the abstention
        self.stopped: dict[str, list[str]] = {}  # renderer, or the judge -> cases that exceeded its time limit
        self.versions: dict[str, str] = {}
        self.with_images = self.without_images = 0  # cases; without images: passed and not kept
        self.factors = PooledFactors()
        self.dark: list[str] = []  # the first scenes without a lit pixel
        self._changing: list[str] = []  # sentences about cases whose two renders differ
        # The largest growth of the subject's memory [bytes per scene], and its case.
        self._growth: tuple[int, str] = (0, "")
        self._examined = self._passing = Examined(pixels=0)
        self._coverage = _nothing_covered()
        self._limits = LimitUse()
        self._answered = Answered()
        self._met: dict[str, list[str]] = {}

    def add(self, record: CaseRecord) -> None:
        """Add the record of a case."""
        self.cases[Outcome(record["verdict"])] += 1
        self.planned_checks += record["planned"]
        self.versions |= record.get("versions", {})
        for name, why in record.get("abstained", {}).items():
            self.abstained.setdefault(name, {})[record["name"]] = why
        for name in record.get("stopped", []):
            self.stopped.setdefault(name, []).append(record["name"])
        if keeps_images(record):
            self.with_images += 1
        elif record["verdict"] == Outcome.PASS:
            self.without_images += 1
        if len(self.dark) < LISTED and record.get("dark"):
            self.dark.append(record["name"])
        self.factors.add(record)
        self._changing += [
            comparison["sentence"] for comparison in record.get("repeated", []) if comparison["verdict"] == Outcome.FAIL
        ]
        self._growth = max(self._growth, (record.get("growth", 0), record["name"]))
        self._limits.add(record)
        self._answered.add(record)
        _cover(self._coverage, record)
        for check in record["checks"]:
            self.checks[check.outcome] += 1
            if check.examined is not None:
                self._examined += check.examined
                if check.outcome is Outcome.PASS:
                    self._passing += check.examined
            if (finding := check.finding) and len(explained := self._met.setdefault(finding, [])) < LISTED:
                explained.append(_name(record, check))

    def case_ledger(self, *, planned: int) -> LedgerRecord:
        """Return the counts of cases by verdict; raise ValueError if they do not add up to the plan.

        Cases that an interrupted run did not reach were planned and are missing.
        """
        missing = Counter({Outcome.MISSING: max(0, planned - self.cases.total())})
        return cast(LedgerRecord, ledger(self.cases + missing, planned=planned))

    def check_ledger(self) -> LedgerRecord:
        """Return the counts of checks by outcome; raise ValueError if they do not add up to the planned checks."""
        return cast(LedgerRecord, ledger(self.checks, planned=self.planned_checks))

    @property
    def changing(self) -> list[str]:
        """Return a sentence about the first case whose two renders differ, and a sentence with the number of others."""
        more = len(self._changing) - 1
        others = "another case that was" if more == 1 else f"{more} more cases that were"
        return self._changing[:1] + [f"so it is with {others} asked again"] * (more > 0)

    @property
    def growing(self) -> list[str]:
        """Return a sentence about the growth of the subject's memory, if it grows."""
        growth, case = self._growth
        return [f"at {case} the program's memory grew by {growth / 1e6:.1f} MB a scene over 100 scenes"] * (growth > 0)

    def verdict(self, *, planned: int, tracer: bool = True) -> Outcome:
        """Return the run's verdict: its worst case's; a case that was not reached is missing.

        For a subject other than the tracer only the cases count that it supports.
        """
        outcomes = concerning(self.cases.elements(), tracer=tracer)
        return worst(outcomes + [Outcome.MISSING] * (planned > self.cases.total()))

    @property
    def examined(self) -> dict[str, int]:
        """Return the pixel counts of the checks of all cases."""
        return self._examined.counts

    @property
    def examined_passing(self) -> dict[str, int]:
        """Return the pixel counts of the checks that passed."""
        return self._passing.counts

    @property
    def coverage(self) -> dict[str, CoverageRecord]:
        """Return per specification item the numbers of cases that measured it and that failed, and the worst check.

        A case only counts if it declares that it covers the item, a configuration ran whose formulas cover it, and a
        check at a stage of the item measured something.
        """
        return self._coverage

    @property
    def answered(self) -> AnsweredRecord:
        """Return the number of planned checks that the subject answered, and the stages that it leaves out."""
        return self._answered.record()

    @property
    def review(self) -> list[ReviewRecord]:
        """Return the limits to look at again: slack in all cases of a kind, or tight in one."""
        return self._limits.review

    @property
    def findings(self) -> list[FindingRecord]:
        """Return the checked-in findings about references, each with the checks of this run that it explained.

        Of more than `LISTED` checks only the first are listed.
        """
        return [{**entry.as_json(), "met": self._met.get(entry.name, [])} for entry in known_findings()]


NEITHER = frozenset({Outcome.UNSUPPORTED, Outcome.MISSING, Outcome.ERROR})  # outcomes of a check without an answer


class Answered:
    """The share of the checks that the subject answered, and the stages that it leaves out in some cases of a kind."""

    def __init__(self) -> None:
        self._families: dict[str, tuple[int, int]] = {}  # checks answered, and planned
        self._answered = self._planned = 0  # cases
        # (Kinds of a case, whether it is refused, stages with an answer, stages without an answer) -> number of cases.
        self._cases: Counter[tuple[tuple[str, ...], bool, frozenset[str], frozenset[str]]] = Counter()

    def add(self, record: CaseRecord) -> None:
        """Add the record of a case; a stage is answered if any check of it measured something or all have an answer."""
        outcomes: dict[tuple[str, str], list[Outcome]] = {}
        for check in record["checks"]:
            outcomes.setdefault((check.configuration, check.stage), []).append(check.outcome)
        stages: dict[bool, set[str]] = {True: set(), False: set()}
        done, planned = self._families.get(record["family"], (0, 0))
        for (_, stage), stage_outcomes in outcomes.items():
            if stage == Stage.CAMERA and {*stage_outcomes} <= {Outcome.UNSUPPORTED, Outcome.UNDECIDED}:
                continue  # the protocol has no channel for it
            answered = not MEASURED.isdisjoint(stage_outcomes) or NEITHER.isdisjoint(stage_outcomes)
            stages[answered].add(stage)
            done, planned = done + answered * len(stage_outcomes), planned + len(stage_outcomes)
        self._families[record["family"]] = done, planned
        self._answered, self._planned = self._answered + bool(stages[True]), self._planned + 1
        kinds = (*record.get("kinds", ()), f"of the family {record['family']}")
        refused = bool(record.get("refused")) or "kinds" not in record
        self._cases[kinds, refused, frozenset(stages[True]), frozenset(stages[False])] += 1

    def record(self) -> AnsweredRecord:
        """Return the entry of results.json."""
        answered = {stage for _, _, stages, _ in self._cases for stage in stages}
        return {
            "checks": sum(done for done, _ in self._families.values()),
            "planned": sum(planned for _, planned in self._families.values()),
            "stages": [stage.value for stage in Stage if stage.value in answered],
            "families": self._families,
            "left_out": self._left_out(),
            "cases": self._answered,
            "planned_cases": self._planned,
        }

    def _left_out(self) -> list[str]:
        """Return sentences about the stages that are left out in some cases of a kind.

        If a stage is left out in all cases with a certain shape, the program just does not draw that shape.
        """
        sentences: dict[tuple[int, int, str], list[str]] = {}
        for stage in IMAGE_STAGES:
            groups = [
                (kinds, stage.value in lacking, count)
                for (kinds, refused, answered, lacking), count in self._cases.items()
                if not refused and stage.value in answered | lacking
            ]
            drawn = {kind for kinds, lacks, _ in groups for kind in kinds if not lacks}
            everywhere = [sum(count for _, lacks, count in groups if lacks or every) for every in (False, True)]
            groups = [
                (("", *kinds), lacks, count)
                for kinds, lacks, count in groups
                if all(kind in drawn for kind in kinds if kind.startswith(DECLARABLE))
            ]
            lost = sum(count for _, lacks, count in groups if lacks)
            if not lost or all(lacks for _, lacks, _ in groups):
                continue
            best: tuple[float, int, int, str] = (0.0, 0, 0, "")
            for kind in dict.fromkeys(kind for kinds, lacks, _ in groups for kind in kinds if lacks):
                without, cases = (
                    sum(count for kinds, lacks, count in groups if kind in kinds and (lacks or every))
                    for every in (False, True)
                )
                # How well the kind describes the cases without the stage: its share of them, times their share of it.
                best = max(
                    best,
                    (without / lost * without / cases, without, cases, kind),
                    key=lambda description: description[0],
                )
            where = best[1:] if best[3] else (everywhere[0], everywhere[1], "")
            sentences.setdefault(where, []).append(stage.value)
        descriptions, all_stages = [], {stage for _, _, stages, _ in self._cases for stage in stages} - {Stage.CAMERA}
        for (without, cases, kind), stages in sentences.items():
            many = f"{without} of the {cases}" if without < cases else f"all {cases}"
            what = ", ".join(stages[:-1]) + f" and {stages[-1]}" if len(stages) > 1 else stages[0]
            what = "answers nothing" if {*stages} == all_stages else f"leaves out {what}"
            descriptions.append(f"{what} in {many} cases {kind.removeprefix(DECLARABLE)}".rstrip())
        return descriptions


class LimitUse:
    """The share of the limit that the checks of each kind use, to find slack and tight limits."""

    def __init__(self) -> None:
        # Place of the group, count, highest ratio, name of its check.
        self._groups: dict[tuple[str, str, str], tuple[int, int, float, str]] = {}
        self._tight: list[
            tuple[float, int, int, str]
        ] = []  # -ratio, index of the group, number of entries before this one, name of the case

    def add(self, record: CaseRecord) -> None:
        """Add the record of a case."""
        for check in record["checks"]:
            # Integers are equal or not: their limit is 0 and cannot be slack.
            if check.stage in (Stage.OBJECT, Stage.VISIBILITY) or check.outcome not in MEASURED:
                continue
            key = (check.configuration, check.reference, check.stage)
            ratio, name = at_worst(check.ratio), _name(record, check)
            place, count, highest, whose = self._groups.get(key, (len(self._groups), 0, ratio, name))
            self._groups[key] = (place, count + 1, *max((highest, whose), (ratio, name)))
            if HIGH < ratio <= 1:
                self._tight.append((-ratio, place, count, name))
                if len(self._tight) >= 2 * LISTED:
                    self._tight = sorted(self._tight)[:LISTED]

    @property
    def review(self) -> list[ReviewRecord]:
        """Return the limits to review, the highest ratio first; at most the `LISTED` highest."""
        slack = [(highest, count, name) for _, count, highest, name in self._groups.values() if highest < LOW]
        listed = [
            ReviewRecord(check=name, ratio=-ratio, why=f"above {HIGH}") for ratio, _, _, name in sorted(self._tight)
        ]
        listed += [
            ReviewRecord(check=name, ratio=highest, why=f"below {LOW} in all {count} cases")
            for highest, count, name in sorted(slack, key=lambda entry: -entry[0])
        ]
        return listed[:LISTED]


def of(records: Iterable[CaseRecord]) -> Totals:
    """Return the totals of records; each record is read once."""
    totals = Totals()
    for record in records:
        totals.add(record)
    return totals


def _nothing_covered() -> dict[str, CoverageRecord]:
    return {
        item: {"cases": 0, "failed": 0, "worst_ratio": 0.0, "worst_check": None, "references": []} for item in ITEMS
    }


def _cover(coverage: dict[str, CoverageRecord], record: CaseRecord) -> None:
    """Add a case's measurements to the coverage of its specification items."""
    compared = [check for check in record["checks"] if check.outcome in MEASURED]
    # Many items are measured by the same checks, whose result is computed once.
    results: dict[tuple[tuple[str, ...], frozenset[str], bool], tuple[bool, set[str], Check] | None] = {}
    for item in record["covers"]:
        stages = STAGE_ITEMS.get(item) or STAGE_ITEMS[item.split("-")[0]]
        ran = frozenset(configuration for configuration, items in record["ran"].items() if item in items)
        shows_in_misses = item.split("-")[0] in ("CAM", "HIT")
        which = stages, ran, shows_in_misses
        if which not in results:
            results[which] = _together(
                [
                    check
                    for check in compared
                    if check.stage in stages
                    and check.configuration in ran
                    and (shows_in_misses or _hits_something(check))
                ]
            )
        result = results[which]
        if result is None:
            continue
        failed, references, worst_check = result
        entry = coverage[item]
        entry["cases"] += 1
        entry["failed"] += failed
        entry["references"] = sorted({*entry["references"], *references})
        if entry["worst_check"] is None or at_worst(worst_check.ratio) > at_worst(entry["worst_ratio"] or 0.0):
            entry["worst_ratio"] = worst_check.ratio
            entry["worst_check"] = _name(record, worst_check)


def _together(checks: list[Check]) -> tuple[bool, set[str], Check] | None:
    """Return whether any check fails, the references, and the check nearest to its limit; None without checks."""
    if not checks:
        return None
    failed = any(check.outcome is Outcome.FAIL for check in checks)
    return failed, {check.reference for check in checks}, max(checks, key=lambda check: at_worst(check.ratio))


def _hits_something(check: Check) -> bool:
    """Return whether a check measured a surface at all; without a hit no normal and no light is measured.

    For hit tests and cameras a miss is a measurement as well as a hit.
    """
    measured = check.end_to_end
    return measured is None or measured.interior > 0


def _name(record: CaseRecord, check: Check) -> str:
    return f"{record['name']} {check.name}"


def results_document(
    planned: Sequence[PlannedCase],
    records: Sequence[CaseRecord],
    totals: Totals,
    chosen_panel: Panel,
    faults: list[str],
    started: datetime,
    subject: Subject,
) -> RunRecord:
    """Return a run's document, as docs/results.md describes it, from its records and their totals."""
    from rayproof.reference import REFERENCES

    versions = totals.versions
    environment = {"python": sys.version.split()[0], "machine": platform.machine(), "system": platform.platform()}
    return {
        "schema": SCHEMA,
        "rayproof": version("rayproof"),
        "command": shlex.join(["rayproof", *sys.argv[1:]]),
        "started": started.isoformat(timespec="seconds"),
        "subject": subject.title,
        "faults": faults,
        "environment": environment | {name: text for name, text in versions.items() if name not in chosen_panel.names},
        "configurations": sorted(configurations_of(planned)),
        "references": {
            name: {
                "version": versions.get(name, "not asked"),
                "precision": REFERENCES[name].precision,
                "independent": bool(REFERENCES.about(name).get("independent", False)),
            }
            for name in chosen_panel.names
        },
        "absent": chosen_panel.absent,
        **come_to(totals, planned=len(planned), tracer=subject.is_tracer),
        "declared": _declared(subject),
        "cases": cast("list[CaseRecord]", records),
    }


def _declared(subject: Subject) -> DeclaredRecord:
    able = subject.capabilities
    declared: DeclaredRecord = {"name": able.title} if able.name else {}
    if able.stages is not None:
        declared["stages"] = [stage.value for stage in able.stages]
    if able.world_normals:
        declared["world_normals"] = True
    return declared


def come_to(totals: Totals, *, planned: int, tracer: bool) -> RunRecord:
    """Return the part of a run's document that follows from its totals: verdict, counts, coverage, limits to review."""
    detail = totals.coverage
    pooled, wide = totals.factors.pooled, totals.factors.wide
    shared = wrong(pooled, wide)
    of_cases = totals.verdict(planned=planned, tracer=tracer)
    part: Any = {
        "verdict": worst([of_cases, *(Outcome.FAIL for _ in (*shared, *totals.changing))]).value,
        "abstained": totals.abstained,
        "stopped": totals.stopped,
        "summary": totals.case_ledger(planned=planned),
        "checks": totals.check_ledger(),
        "answered": totals.answered,
        "examined": totals.examined,
        "examined_passing": totals.examined_passing,
        "common_factors": pooled,
        "wide_limits": wide,
        "wrong_factors": shared,
        "changing": totals.changing,
        "growing": totals.growing,
        "coverage": {item: entry["cases"] for item, entry in detail.items()},
        "coverage_detail": detail,
        "images_kept": {"cases": totals.with_images, "left_out": totals.without_images},
        "review": totals.review,
        "findings": totals.findings,
    }
    return part


def uncountable(record: CaseRecord) -> str | None:
    """Return a line with the reason why a record from elsewhere cannot be counted with a run's records, or None."""
    try:
        come_to(of((record,)), planned=1, tracer=True)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        return legible(f"{type(error).__name__}: {error}")
    return None
