"""The gate of a CI job: hold a run against what is known to fail and against earlier runs, and write expectations."""

import math
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Any, cast

from rayproof.reports.history.database import WORSE_ERROR, append, opened, read_series, revision, worse
from rayproof.reports.history.expectations import EXPECTABLE, Expectation
from rayproof.reports.history.run_difference import LEAST_RATIO, ORDER, compared, paired
from rayproof.reports.results.case_records import CaseRecord, CheckRecord
from rayproof.reports.results.document import load_results
from rayproof.reports.results.headline import blamed_items, of_the_whole
from rayproof.reports.results.outcomes import MEASURED, Outcome
from rayproof.reports.results.records import GateRecord, RunRecord

GOOD = (Outcome.PASS, Outcome.WARN, Outcome.UNDECIDED, Outcome.UNSUPPORTED)
SHOW_NOTHING = (Outcome.ERROR, Outcome.MISSING)


@dataclass(frozen=True, kw_only=True)
class Base:
    """What a run is held against: the results of an earlier one, or a file with a history."""

    name: str  # as the user wrote it
    results: RunRecord | None  # None: a history


def load_base(path: Path) -> Base:
    """Return the run in a folder, or the history in a file.

    Raises:
        OSError, ValueError: it is neither; the message names the file.

    """
    if path.is_dir():
        return Base(name=str(path), results=load_results(path))
    with opened(path):
        pass  # it is one, and can be read
    return Base(name=str(path), results=None)


@dataclass(frozen=True, kw_only=True)
class Standing:
    """How a run stands before an earlier one, in sentences that begin with the case."""

    worse: list[str]
    as_before: list[str]  # what fails, and did not become worse
    cases: list[str]  # names of cases that fail, and in which nothing became worse


def standing(results: RunRecord, base: Base) -> Standing:
    """Return what became worse since `base`, and what fails as it did."""
    return _before_history(results, base) if base.results is None else _before_run(results, base.name, base.results)


def _before_run(results: RunRecord, name: str, earlier: RunRecord) -> Standing:
    known = {case["name"]: case for case in earlier["cases"]}
    pairs = paired(*([str(one) for one in run.get("configurations", ())] for run in (earlier, results)))
    found, same, cases = [], [], []
    for case in results["cases"]:
        before = known.get(case["name"])
        told, kept = [], []
        if before is None:
            told = [f"{case['verdict']}, and {name} does not have it"] if case["verdict"] not in GOOD else []
        else:
            for row in compared(before, case, pairs):
                where = f"{row['configuration']} {row['reference']} {row['stage']}"
                said = _worse(row)
                told += [f"{where}: {said}"] if said else []
                if not said and row["after"] is not None and row["after"][0] not in GOOD:
                    kept.append(f"{where}: {row['after'][0]}, as in {name}")
            if not told and not kept and ORDER.index(case["verdict"]) > ORDER.index(before["verdict"]):
                told = [f"{case['verdict']}, was {before['verdict']}"]
        found += [f"{case['name']}: {sentence}" for sentence in told]
        same += [f"{case['name']}: {sentence}" for sentence in kept]
        if case["verdict"] not in GOOD and not told:
            cases.append(case["name"])
    return Standing(worse=found, as_before=same, cases=cases)


def _worse(row: Mapping[str, Any]) -> str | None:
    """Return in words how a check became worse, or None."""
    before, after = row["before"], row["after"]
    if after is None:
        return f"was {before[0]}, and is not made any more"
    if before is None:
        return f"{after[0]}, and was not made before" if after[0] not in GOOD else None
    # A crash shows less than a failure, though it is no worse a verdict.
    if ORDER.index(after[0]) > ORDER.index(before[0]) or (after[0] in SHOW_NOTHING and after[0] != before[0]):
        return f"{after[0]}, was {before[0]}"
    if before[1] is None or after[1] is None or after[1] < LEAST_RATIO or after[1] <= WORSE_ERROR * before[1]:
        return None
    return f"worst error / limit {after[1]:.3g}, was {before[1]:.3g}"


def _before_history(results: RunRecord, base: Base) -> Standing:
    """Return how a run stands in a history, of which a copy takes it up: the file itself is `--history`'s to write."""
    with tempfile.TemporaryDirectory(prefix="rayproof-against-") as folder:
        copy = Path(folder, "history.sqlite")
        shutil.copyfile(base.name, copy)
        run = append(copy, results, revision())
        with opened(copy) as connection:
            found = worse(read_series(connection, str(results.get("subject", "tracer"))), run)
    named = {entry["case"] for entry in found}
    cases = [case["name"] for case in results["cases"] if case["verdict"] not in GOOD and case["name"] not in named]
    return Standing(
        worse=[entry["sentence"] for entry in found],
        as_before=[f"{name}: fails, and is no worse than in {base.name}" for name in cases],
        cases=cases,
    )


# Hold a finished run against what is expected of it.


# What keeps a gate shut, the most telling first.
SHUTTING = ("regressions", "worse", "uncovered", "tighten", "stale", "expired")


@dataclass(kw_only=True)
class Gate:
    """What came of it: each list holds sentences that begin with the check or the entry they are about."""

    file: str  # what it holds a run against, in words
    regressions: list[str] = field(default_factory=list)  # fails, and is not expected, or not so
    tighten: list[str] = field(default_factory=list)  # fails less than expected, or no longer
    stale: list[str] = field(default_factory=list)  # entries about planned cases that meet no check of theirs
    expired: list[str] = field(default_factory=list)  # entries about planned cases whose last day is over
    worse: list[str] = field(default_factory=list)  # what is worse than in the run or history that it is held against
    uncovered: list[str] = field(default_factory=list)  # that too few of the checks were measured
    matched: list[str] = field(default_factory=list)  # checks that fail as expected, with the reason given
    cases: list[str] = field(default_factory=list)  # names of cases of which all that fails is expected

    @property
    def red(self) -> bool:
        """Say whether the gate stays shut."""
        return any(getattr(self, kind) for kind in SHUTTING)

    @property
    def sentence(self) -> str:
        """Return what came of it in one sentence."""
        parts = [f"{len(self.matched)} failing checks are expected"]
        parts += [f"{len(self.regressions)} regressions"] if self.regressions else []
        parts += [f"{len(self.tighten)} fail less than expected"] if self.tighten else []
        parts += [f"{len(self.stale)} entries meet no check"] if self.stale else []
        parts += [f"{len(self.expired)} entries are expired"] if self.expired else []
        parts += [f"{len(self.worse)} became worse"] if self.worse else []
        parts += self.uncovered
        return f"The gate {self.file} is {'shut' if self.red else 'open'}: {', '.join(parts)}."

    def record(self) -> GateRecord:
        """Return it as results.json has it."""
        return cast(GateRecord, {"sentence": self.sentence, "red": self.red, **asdict(self)})


@dataclass(frozen=True, kw_only=True)
class Demanded:
    """What a user demands of a run beside that it passes; nothing of it by default."""

    expected: tuple[str, tuple[Expectation, ...]] | None = None  # what is known to fail: a file's name, its entries
    against: Base | None = None  # nothing may be worse than there
    least_coverage: float | None = None  # %, of the checks that must be measured

    @property
    def lets_through(self) -> bool:
        """Say whether some failures are let through."""
        return self.expected is not None or self.against is not None

    @property
    def anything(self) -> bool:
        """Say whether anything is demanded."""
        return self.lets_through or self.least_coverage is not None


def held(results: RunRecord, demanded: Demanded, *, today: date | None = None) -> Gate:
    """Return what a run's record (`results.json`) comes to before what is demanded of it."""
    file, expected = demanded.expected or ("", ())
    names = [file] if demanded.expected else []
    names += [f"against {demanded.against.name}"] if demanded.against else []
    names += [f"of at least {demanded.least_coverage:g} % coverage"] if demanded.least_coverage is not None else []
    called = ", ".join(names)
    if demanded.expected is not None:
        found = gate(results, expected, file=called, today=today)
    else:
        found = Gate(file=called)
        _hold_the_whole(results, found)
    if demanded.against is not None:
        stands = standing(results, demanded.against)
        found.worse = stands.worse
        if demanded.expected is None:
            found.matched, found.cases = stands.as_before, stands.cases
    if demanded.least_coverage is not None:
        share, told = coverage(results)
        if not share >= demanded.least_coverage:
            found.uncovered = [f"{told}, and {demanded.least_coverage:g} % are demanded"]
    return found


def coverage(results: RunRecord) -> tuple[float, str]:
    """Return the share [%] of the planned checks that were measured (0 where none was planned), and it in words."""
    counted = cast("dict[str, int]", results["checks"])
    planned = counted["planned"]
    measured = sum(counted.get(one.value, 0) for one in MEASURED)
    share = 100 * measured / planned if planned else 0.0
    return share, f"{measured} of {planned} checks ({share:.1f} %) were measured"


def gate(results: RunRecord, expected: Sequence[Expectation], *, file: str, today: date | None = None) -> Gate:
    """Return what a run's record (`results.json`) comes to before expectations.

    Only entries about planned cases count, so that the shards of a suite can share a file.
    """
    today = today or date.today()
    found = Gate(file=file)
    valid: list[Expectation] = []
    for entry in expected:
        if not any(entry.about_case(case["name"]) for case in results["cases"]) or not entry.holds_for(results):
            continue
        if entry.expired(today):
            found.expired.append(f"{entry.name}: expired on {entry.expires}: {entry.reason}")
        else:
            valid.append(entry)
    met: dict[int, list[str]] = {place: [] for place in range(len(valid))}
    for case in results["cases"]:
        _hold_case(case, valid, met, found)
    for place, verdicts in met.items():
        if not verdicts:
            found.stale.append(f"{valid[place].name}: no check of the run is called so")
        elif all(verdict in GOOD for verdict in verdicts):
            found.tighten.append(f"{valid[place].name}: passes now, and is expected to fail: {valid[place].reason}")
    _hold_the_whole(results, found)
    return found


def _hold_the_whole(results: RunRecord, found: Gate) -> None:
    found.regressions += [f"the whole run: {sentence}" for sentence in of_the_whole(results)]
    if not results.get("finished", False):
        found.regressions.append("the whole run: it is not finished, so that not all is known")


def _hold_case(case: CaseRecord, valid: Sequence[Expectation], met: dict[int, list[str]], found: Gate) -> None:
    """Hold the checks of one case against the entries about them."""
    bad = expected = 0
    for check in case["checks"]:
        about = [place for place, entry in enumerate(valid) if entry.about(case["name"], check)]
        for place in about:
            met[place].append(check["verdict"])
        if check["verdict"] in GOOD:
            continue
        bad += 1
        where = f"{case['name']} {check['configuration']} {check['reference']} {check['stage']}"
        if not about:
            found.regressions.append(f"{where}: {check['verdict']}, and no entry is about it")
            continue
        # Of several entries about a check it is enough to be as one of them says.
        objections = [_objection(case, check, valid[place]) for place in about]
        if None in objections:
            entry = valid[about[objections.index(None)]]
            found.matched.append(f"{where}: {entry.reason}")
            expected += 1
            continue
        kind, why = next((each for each in objections if each and each[0] == "tighten"), objections[0] or ("", ""))
        (found.tighten if kind == "tighten" else found.regressions).append(f"{where}: {why}")
    # A closed form fails a case without a check of its own: no entry can be about that.
    for told in case.get("expectations") or ():
        if told.get("verdict", Outcome.PASS) not in GOOD:
            bad += 1
            found.regressions.append(f"{case['name']}: {told['verdict']} of its expectations, of which no entry can be")
    if not bad and case["verdict"] not in GOOD:
        found.regressions.append(f"{case['name']}: {case['verdict']}: {case.get('reason') or 'no check says why'}")
    elif bad and bad == expected:
        found.cases.append(case["name"])


def _objection(case: CaseRecord, check: CheckRecord, entry: Expectation) -> tuple[str, str] | None:
    """Return what a check that fails has against an entry, or None if it fails as the entry says."""
    ratio, wrong = figures(check)
    if check["verdict"] not in EXPECTABLE or math.isnan(ratio) or any(_not_finite(check)):
        return "regression", f"{check['verdict']}, where nothing can be expected of it: {check.get('reason') or ''}"
    if check["verdict"] != entry.verdict:
        return "regression", f"{check['verdict']}, and {entry.verdict} is expected"
    if entry.item is not None and entry.item not in (case.get("blamed_items") or [case.get("item")]):
        return "regression", f"{blamed_items(case) or 'nothing'} is blamed, and {entry.item} is expected"
    for what, value, (low, high) in (("error over limit", ratio, entry.ratio), ("wrong pixels", wrong, entry.wrong)):
        if not value <= high:
            return "regression", f"{value:.4g} {what}, and at most {high:.4g} is expected"
        if value < low:
            return "tighten", f"{value:.4g} {what}, and at least {low:.4g} is expected"
    return None


def figures(check: CheckRecord) -> tuple[float, int]:
    """Return a check's worst error over its limit, and how many pixels are over it."""
    return float(check.get("ratio") or 0.0), int((check.get("examined") or {}).get("wrong", 0))


def _not_finite(check: CheckRecord) -> Iterator[bool]:
    """Yield of each value that the check shows of the one under test whether it is NaN or infinite."""
    for key in ("end_to_end", "continued"):
        for value in (check.get(key) or {}).get("ours") or ():
            yield not math.isfinite(float(value))


# Write what fails into a file of expectations, and take out of it what no longer does.


SLACK = 0.1  # of error and of wrong pixels, either way: what another processor's roundings may change


def accepted(
    results: RunRecord,
    known: Sequence[Expectation],
    *,
    reason: str,
    expires: str | None,
    issue: str | None,
    when: Mapping[str, str],
) -> tuple[tuple[Expectation, ...], int]:
    """Return the entries with one more for each failing check that none is about, and how many those are."""
    new = []
    for case in results["cases"]:
        for check in case["checks"]:
            if check["verdict"] not in EXPECTABLE or any(
                one.about(case["name"], check) and one.holds_for(results) for one in known
            ):
                continue
            ratio, wrong = figures(check)
            new.append(
                Expectation(
                    case=_plainly(case["name"]),
                    configuration=_plainly(check["configuration"]),
                    reference=_plainly(check["reference"]),
                    stage=check["stage"],
                    verdict=check["verdict"],
                    reason=reason,
                    ratio=(_rounded(ratio / (1 + SLACK)), _rounded(ratio * (1 + SLACK))),
                    wrong=(math.floor(wrong / (1 + SLACK)), math.ceil(wrong * (1 + SLACK))),
                    item=case.get("item"),
                    expires=expires,
                    issue=issue,
                    when=when,
                )
            )
    return (*known, *new), len(new)


def pruned(results: RunRecord, known: Sequence[Expectation]) -> tuple[tuple[Expectation, ...], list[str]]:
    """Return the entries without those whose checks pass, others narrowed to what is there, and what was done.

    It only shrinks: no entry is added, and none becomes wider. Entries about cases that were not run stay as they are.
    """
    kept, done = [], []
    for entry in known:
        checks = [check for case in results["cases"] for check in case["checks"] if entry.about(case["name"], check)]
        planned = any(entry.about_case(case["name"]) for case in results["cases"])
        if not planned or not entry.holds_for(results):
            kept.append(entry)
            continue
        failing = [check for check in checks if check["verdict"] not in GOOD]
        if not failing:
            done.append(f"removed: {entry.name}: {'passes now' if checks else 'no check is called so'}")
            continue
        ratios, wrongs = zip(*map(figures, failing), strict=True)
        narrow = replace(
            entry,
            ratio=_narrowed(entry.ratio, _rounded(max(ratios) * (1 + SLACK)), _rounded(min(ratios) / (1 + SLACK))),
            wrong=_narrowed(entry.wrong, math.ceil(max(wrongs) * (1 + SLACK)), math.floor(min(wrongs) / (1 + SLACK))),
        )
        if narrow != entry:
            done.append(f"narrowed: {entry.name}")
        kept.append(narrow)
    return tuple(kept), done


def _narrowed(old: tuple[Any, Any], high: Any, low: Any) -> tuple[Any, Any]:
    """Return a range that allows no more than before at its upper end, and begins no higher than what is there."""
    return min(old[0], low), min(old[1], max(high, low))


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")


def _plainly(name: str) -> str:
    """Return a pattern that means the name and nothing else."""
    return "".join(f"[{one}]" if one in "*?[" else one for one in name)
