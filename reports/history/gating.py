"""The gate: a run is held against known failures and earlier runs; accepting and pruning expectations."""

import math
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import date
from pathlib import Path
from typing import cast

import msgspec

from rayproof.cases.stages import Stage
from rayproof.reports.history.database import WORSE_ERROR, append, opened, read_series, revision, worse
from rayproof.reports.history.expectations import (
    EXPECTABLE,
    NO_CELLS,
    SLACK,
    Bound,
    Bounds,
    Expectation,
    KnownCheck,
    KnownFailures,
    plainly,
    range_of,
)
from rayproof.reports.history.run_difference import LEAST_RATIO, ORDER, both, paired
from rayproof.reports.results.case_records import CaseRecord, Check
from rayproof.reports.results.document import load_results
from rayproof.reports.results.files import several
from rayproof.reports.results.headline import blamed_items, gate_counts, of_the_whole
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import SHUTTING, GateRecord, RunRecord

GOOD = (Outcome.PASS, Outcome.WARN, Outcome.UNDECIDED, Outcome.UNSUPPORTED)
RIGHT = (Outcome.PASS, Outcome.WARN)
LEAST_OF_BEFORE = 0.99  # of the share of the checks that was answered when it was accepted
SHOW_NOTHING = (Outcome.ERROR, Outcome.MISSING, Outcome.UNDECIDED, Outcome.UNSUPPORTED)


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


@dataclass(kw_only=True)
class GateResult:
    """The result: each list holds a sentence for each case or entry, which begins with its name."""

    file: str  # what it holds a run against, in words
    regressions: list[str] = field(default_factory=list)  # fails, and is not expected, or not so
    tighten: list[str] = field(default_factory=list)  # fails less than expected, or no longer
    stale: list[str] = field(default_factory=list)  # entries about planned cases that meet no check of theirs
    expired: list[str] = field(default_factory=list)  # entries about planned cases whose last day is over
    worse: list[str] = field(default_factory=list)  # what is worse than in the run or history that it is held against
    uncovered: list[str] = field(default_factory=list)  # that too few of the checks were measured, or answered
    matched: list[str] = field(default_factory=list)  # cases with checks that fail as expected or as before, and why
    cases: list[str] = field(default_factory=list)  # names of cases of which all that fails is expected, or as before
    mended: list[str] = field(default_factory=list)  # cases that failed in the run that it is held against, and pass

    @property
    def red(self) -> bool:
        """Say whether the gate stays shut."""
        return any(getattr(self, kind) for kind in SHUTTING)

    @property
    def sentence(self) -> str:
        """Return what came of it in one sentence."""
        said = ", ".join(gate_counts(cast(GateRecord, asdict(self)))) or "nothing fails"
        return f"The gate {self.file} is {'red' if self.red else 'green'}: {said}."

    def record(self) -> GateRecord:
        """Return it as results.json has it."""
        return cast(GateRecord, {"sentence": self.sentence, "red": self.red, **asdict(self)})


def standing(results: RunRecord, base: Base) -> GateResult:
    """Return what became worse since `base`, and what fails as it did."""
    return _before_history(results, base) if base.results is None else _before_run(results, base.name, base.results)


def _before_run(results: RunRecord, name: str, earlier: RunRecord) -> GateResult:
    known = {case["name"]: case for case in earlier["cases"]}
    pairs = paired(*([str(one) for one in run.get("configurations", ())] for run in (earlier, results)))
    found, same, cases, mended = [], [], [], []
    for case in results["cases"]:
        before = known.get(case["name"])
        if before is not None and before["verdict"] not in GOOD and case["verdict"] in RIGHT:
            mended.append(f"{case['name']}: {case['verdict']}, was {before['verdict']} in {name}")
        worsened, kept = [], []
        if before is None:
            worsened = [f"{case['verdict']}, and {name} does not have it"] if case["verdict"] not in GOOD else []
        else:
            for key, (earlier_check, check) in both(before, case, pairs).items():
                where = " ".join(key)
                why = _worse(earlier_check, check)
                worsened += [f"{where}: {why}"] if why else []
                if not why and check is not None and check.outcome not in GOOD:
                    kept.append(f"{where}: {check.outcome}, as in {name}")
            if not worsened and not kept and ORDER.index(case["verdict"]) > ORDER.index(before["verdict"]):
                worsened = [f"{case['verdict']}, was {before['verdict']}"]
        found += _for_a_case(case["name"], worsened)
        same += _for_a_case(case["name"], kept)
        if case["verdict"] not in GOOD and not worsened:
            cases.append(case["name"])
    return GateResult(file=name, worse=found, matched=same, cases=cases, mended=mended)


def _for_a_case(name: str, sentences: Sequence[str]) -> list[str]:
    """Return in one sentence what was found of a case's checks: of the first, and of how many more; of none nothing."""
    more = f" (and {len(sentences) - 1} more of its checks)" if len(sentences) > 1 else ""
    return [f"{name}: {sentences[0]}{more}"] if sentences else []


def _worse(before: Check | None, after: Check | None) -> str | None:
    """Return in words how a check became worse, or None."""
    if after is None:
        return f"was {before.outcome}, and is not made any more" if before is not None else None
    now = after.outcome
    if before is None:
        return f"{now}, and was not made before" if now not in GOOD else None
    was = before.outcome
    # What shows nothing is no better than a failure.
    if ORDER.index(now) > ORDER.index(was) or (now in SHOW_NOTHING and now != was):
        return f"{now}, was {was}"
    for what, value, earlier in zip(
        (*FIGURES, "pixels without a finite number"),
        (*figures(after), not_finite(after)),
        (*figures(before), not_finite(before)),
        strict=True,
    ):
        if (value >= LEAST_RATIO or what != FIGURES[0]) and value > WORSE_ERROR * earlier:
            return f"{what} {value:.5g}, was {earlier:.5g}"
    if before.cells is not None and (strays := _elsewhere(after, before.cells[1])):
        return f"pixels are wrong in {strays}"
    return None


def _elsewhere(check: Check, allowed: str) -> str | None:
    """Return in words in how many cells a check's pixels are wrong where they may not be, or None."""
    cells = int((check.cells or NO_CELLS)[0], 16) & ~int(allowed, 16)
    return f"{cells.bit_count()} of 64 parts of the image in which they were right" if cells else None


def _before_history(results: RunRecord, base: Base) -> GateResult:
    """Return how a run stands in a history, of which a copy takes it up: the file itself is `--history`'s to write."""
    with tempfile.TemporaryDirectory(prefix="rayproof-against-") as folder:
        copy = Path(folder, "history.sqlite")
        shutil.copyfile(base.name, copy)
        run = append(copy, results, revision())
        with opened(copy) as connection:
            found = worse(read_series(connection, str(results.get("subject", "tracer"))), run)
    named = {entry["case"] for entry in found}
    cases = [case["name"] for case in results["cases"] if case["verdict"] not in GOOD and case["name"] not in named]
    return GateResult(
        file=base.name,
        worse=[entry["sentence"] for entry in found],
        matched=[f"{name}: fails, and is no worse than in {base.name}" for name in cases],
        cases=cases,
    )


# Hold a finished run against what is expected of it.


@dataclass(frozen=True, kw_only=True)
class Demanded:
    """The conditions that a user sets for a run; by default there are none."""

    expected: tuple[str, KnownFailures] | None = None  # what is known to fail: a file's name, and what it holds
    against: Base | None = None  # nothing may be worse than there
    least_coverage: float | None = None  # %, of the cases that must be answered

    @property
    def lets_through(self) -> bool:
        """Say whether some failures are let through."""
        return self.expected is not None or self.against is not None


def held(results: RunRecord, demanded: Demanded, *, today: date | None = None) -> GateResult:
    """Return what a run's record (`results.json`) comes to before what is demanded of it."""
    file, known = demanded.expected or ("", KnownFailures())
    names = [file] if demanded.expected else []
    names += [f"against {demanded.against.name}"] if demanded.against else []
    names += [f"of at least {demanded.least_coverage:g} % coverage"] if demanded.least_coverage is not None else []
    called = ", ".join(names)
    if demanded.expected is not None or demanded.against is None:
        result = gate(results, known, file=called, today=today)
    else:
        result = GateResult(file=called)
        _hold_the_whole(results, result)
    if demanded.against is not None:
        stands = standing(results, demanded.against)
        result.worse, result.mended = stands.worse, stands.mended
        if demanded.expected is None:
            result.matched, result.cases = stands.matched, stands.cases
    if demanded.least_coverage is not None:
        share, told = coverage(results)
        if not share >= demanded.least_coverage:
            result.uncovered.append(f"{told}, and {demanded.least_coverage:g} % are demanded")
    return result


def coverage(results: RunRecord) -> tuple[float, str]:
    """Return the share [%] of the cases that were answered (0 where none was planned), and it in words."""
    answered = results.get("answered") or {}
    cases, planned = answered.get("cases", 0), answered.get("planned_cases", 0)
    share = 100 * cases / planned if planned else 0.0
    return share, f"{cases} of {several(planned, 'case')} ({share:.1f} %) were answered"


def gate(results: RunRecord, known: KnownFailures, *, file: str, today: date | None = None) -> GateResult:
    """Return what a run's record (`results.json`) comes to before a file of known failures.

    Only entries about planned cases count, so that the shards of a suite can share a file.
    """
    today = today or date.today()
    result = GateResult(file=file)
    valid: list[Expectation] = []
    for entry in known.expected:
        if not any(entry.about_case(case["name"]) for case in results["cases"]) or not entry.holds_for(results):
            continue
        if entry.expired(today):
            result.expired.append(f"{entry.name}: expired on {entry.expires}: {entry.reason}")
        else:
            valid.append(entry)
    met: dict[tuple[int, str], list[str]] = {(k, name): [] for k, entry in enumerate(valid) for name in entry.checks}
    for case in results["cases"]:
        _hold_case(case, valid, met, result)
    for place, entry in enumerate(valid):
        verdicts = {name: met[place, name] for name in entry.checks}
        gone = [f"no check of the run is called {name}" for name in verdicts if not verdicts[name]]
        right = [name for name, seen in verdicts.items() if seen and all(verdict in RIGHT for verdict in seen)]
        silent = {name: seen for name, seen in verdicts.items() if seen and {*seen} <= {*GOOD} and {*seen} - {*RIGHT}}
        result.stale += _for_a_case(entry.name, gone)
        result.tighten += _for_a_case(entry.name, [f"{name} passes now, and is expected to fail" for name in right])
        why = [f"{name} is {seen[0]}, which does not show whether it still fails" for name, seen in silent.items()]
        result.regressions += _for_a_case(entry.name, why)
    _hold_the_whole(results, result)
    result.uncovered += _answers_less(results, known)
    return result


def _answers_less(results: RunRecord, known: KnownFailures) -> list[str]:
    """Return in sentences of which families a smaller share of the checks is answered than when that was accepted."""
    found = []
    for family, (done, planned) in (results.get("answered") or {}).get("families", {}).items():
        before, of = known.answered.get(family, (0, 0))
        # Times both numbers of checks, so that nothing is rounded.
        if done * of < LEAST_OF_BEFORE * before * planned:
            was = f"{100 * before / of:.4g} %"
            found.append(
                f"{family}: {done} of {planned} checks ({100 * done / planned:.4g} %) are answered, {was} were"
            )
    return found


def _hold_the_whole(results: RunRecord, found: GateResult) -> None:
    found.regressions += [f"the whole run: {sentence}" for sentence in of_the_whole(results)]
    if not results.get("finished", False):
        found.regressions.append("the whole run: it is not finished, so that not all is known")


def _hold_case(
    case: CaseRecord, valid: Sequence[Expectation], met: dict[tuple[int, str], list[str]], result: GateResult
) -> None:
    """Hold the checks of one case against the entries about them."""
    known: dict[str, int] = {}  # the reasons of what is expected: how many checks
    wrong: dict[str, list[str]] = {"regressions": [], "tighten": []}
    entries = [(place, entry) for place, entry in enumerate(valid) if entry.about_case(case["name"])]
    for check in case["checks"] if entries or case["verdict"] not in RIGHT else ():
        about = [(entry, name, place) for place, entry in entries if (name := entry.about(case["name"], check))]
        for _, name, place in about:
            met[place, name].append(check.outcome)
        if check.outcome in GOOD:
            continue
        where = check.name
        if not about:
            wrong["regressions"].append(f"{where}: {check.outcome}, and no entry is about it")
            continue
        # Of several entries about a check it is enough to be as one of them says.
        objections = [_objection(case, check, entry, entry.checks[name]) for entry, name, _ in about]
        if None in objections:
            entry = about[objections.index(None)][0]
            known[entry.reason] = known.get(entry.reason, 0) + 1
            continue
        kind, why = min(filter(None, objections), key=lambda objection: objection[0] != "tighten")
        wrong[kind].append(f"{where}: {why}")
    # A closed form fails a case without a check of its own: no entry can be about that.
    closed = [told["verdict"] for told in case.get("expectations") or () if told.get("verdict") not in (None, *GOOD)]
    wrong["regressions"] += [f"{verdict} of its expectations, of which no entry can be" for verdict in closed]
    if not any([known, *wrong.values()]) and case["verdict"] not in GOOD:
        wrong["regressions"].append(f"{case['verdict']}: {case.get('reason') or 'no check says why'}")
    result.regressions += _for_a_case(case["name"], wrong["regressions"])
    result.tighten += _for_a_case(case["name"], wrong["tighten"])
    result.matched += [f"{case['name']}: {several(n, 'failing check')}: {reason}" for reason, n in known.items()]
    if known and not any(wrong.values()):
        result.cases.append(case["name"])


def _objection(case: CaseRecord, check: Check, entry: Expectation, known: KnownCheck) -> tuple[str, str] | None:
    """Return what a check that fails has against an entry, or None if it fails as the entry says."""
    if (why := unexpectable(check)) is not None:
        return "regressions", why
    if check.outcome != known.verdict:
        return "regressions", f"{check.outcome}, and {known.verdict} is expected"
    if entry.item is not None and entry.item not in (case.get("blamed_items") or [case.get("item")]):
        return "regressions", f"{blamed_items(case) or 'nothing'} is blamed, and {entry.item} is expected"
    for what, value, (low, high) in zip(FIGURES, figures(check), known.ranges, strict=True):
        if not value <= high:
            return "regressions", f"{value:.4g} {what}, and at most {high:.4g} is expected"
        if value < low:
            return "tighten", f"{value:.4g} {what}, and at least {low:.4g} is expected"
    strays = None if known.cells is None else _elsewhere(check, known.cells)
    return None if strays is None else ("regressions", f"pixels are wrong in {strays}")


def unexpectable(check: Check) -> str | None:
    """Return in words why no entry can be about a check that fails, or None."""
    if check.outcome not in EXPECTABLE:
        return f"{check.outcome}, where nothing can be expected of it: {check.reason}"
    count = not_finite(check)
    if count or math.isnan(figures(check)[0]):
        return f"{count} pixels without a finite number, of which nothing can be expected"
    return None


FIGURES = ("error over limit", "wrong pixels", "mean error of the wrong pixels")


def figures(check: Check) -> tuple[float, int, float]:
    """Return a check's worst error over its limit, how many pixels are over it, and their mean error."""
    means = [measured.mean_wrong for measured in (check.end_to_end, check.continued) if measured is not None]
    wrong = check.examined.wrong if check.examined else 0
    return check.ratio, wrong, next(filter(None, means), 0.0)


def not_finite(check: Check) -> int:
    """Return in how many pixels the renderer under test has NaN, or an infinity that is no miss."""
    measured = [one for one in (check.end_to_end, check.continued) if one is not None]
    return max((one.nan + (one.inf if check.stage is not Stage.DISTANCE else 0) for one in measured), default=0)


# Write what fails into a file of known failures, and take out of it what no longer does.


@dataclass(frozen=True, kw_only=True)
class Acceptance:
    """What is accepted, and why; by default every failing check."""

    reason: str
    cases: tuple[str, ...] = ()  # names of cases; empty: all
    cause: str | None = None  # name of a mistake: only cases that it explains
    expires: str | None = None
    issue: str | None = None
    when: Mapping[str, str] = field(default_factory=dict)

    def covers(self, case: CaseRecord) -> bool:
        """Return whether failing checks of a case are accepted."""
        if self.cause is not None and self.cause not in (case.get("cause") or ()):
            return False
        return not self.cases or case["name"] in self.cases


def accepted(results: RunRecord, known: KnownFailures, acceptance: Acceptance) -> tuple[KnownFailures, int, list[str]]:
    """Return the file with the failing checks that none of its entries is about, how many, and what cannot be accepted.

    Of each family it also says how many checks were answered.
    Checks of a case with the same item, reason and conditions are one expectation.
    """
    expectations = list(known.expected)
    count, refused = 0, []
    for case in filter(acceptance.covers, results["cases"]):
        about = [entry for entry in known.expected if entry.about_case(case["name"]) and entry.holds_for(results)]
        new: dict[str, KnownCheck] = {}
        for check in case["checks"]:
            if check.outcome in GOOD or any(entry.about(case["name"], check) for entry in about):
                continue
            where = check.name
            if (why := unexpectable(check)) is not None:
                refused.append(f"{case['name']}: {where}: {why}")
                continue
            ratio, wrong, error = figures(check)
            new[plainly(check.name)] = KnownCheck(
                verdict=check.outcome,  # type: ignore[arg-type]
                ratio=_rounded(ratio),
                wrong=wrong,
                error=_rounded(error),
                cells=(check.cells or NO_CELLS)[1],
            )
        if not new:
            continue
        count += len(new)
        expectation = Expectation(
            case=plainly(case["name"]),
            reason=acceptance.reason,
            checks=new,
            item=case.get("item"),
            cause=acceptance.cause or _only_cause(case),
            expires=acceptance.expires,
            issue=acceptance.issue,
            when=acceptance.when,
        )
        alike = (k for k, old in enumerate(expectations) if msgspec.structs.replace(old, checks=new) == expectation)
        if (place := next(alike, None)) is None:
            expectations.append(expectation)
        else:
            checks = {**expectations[place].checks, **new}
            expectations[place] = msgspec.structs.replace(expectation, checks=checks)
    answered = {**known.answered, **(results.get("answered") or {}).get("families", {})}
    return msgspec.structs.replace(known, expected=expectations, answered=answered), count, refused


def _only_cause(case: CaseRecord) -> str | None:
    """Return the name of the mistake that explains a case's failure; None if there is none, or more than one."""
    names = case.get("cause") or ()
    return names[0] if len(names) == 1 else None


def pruned(results: RunRecord, known: KnownFailures) -> tuple[KnownFailures, list[str]]:
    """Return the file without checks that pass or are gone, others narrowed to what is there, and a line for each case.

    It only shrinks: no entry is added, and none becomes wider. What was not run, or not measured, stays as it is.
    """
    kept, done = [], []
    for entry in known.expected:
        cases = [case for case in results["cases"] if entry.about_case(case["name"])]
        if not cases or not entry.holds_for(results):
            kept.append(entry)
            continue
        seen: dict[str, list[Check]] = {name: [] for name in entry.checks}
        for case in cases:
            for check in case["checks"]:
                if (name := entry.about(case["name"], check)) is not None:
                    seen[name].append(check)
        left = {name: _narrowed(entry.checks[name], checks) for name, checks in seen.items() if not _over(checks)}
        narrowed = sum(check != entry.checks[name] for name, check in left.items())
        counts = ((len(entry.checks) - len(left), "pass now or are gone"), (narrowed, "fail less and are narrowed"))
        if words := ", ".join(f"{count} {what}" for count, what in counts if count):
            done.append(f"{entry.name}: of {len(entry.checks)} checks {words}")
        if left:
            kept.append(msgspec.structs.replace(entry, checks=left))
    return msgspec.structs.replace(known, expected=kept), done


def _over(checks: Sequence[Check]) -> bool:
    """Say whether what an entry says of some checks is over: they pass, or there are none."""
    return all(check.outcome in RIGHT for check in checks)


def _narrowed(known: KnownCheck, checks: Sequence[Check]) -> KnownCheck:
    """Return what is known of some checks with ranges that end no higher, and begin no higher than what is there."""
    failing = [figures(check) for check in checks if check.outcome in EXPECTABLE]
    if not failing:
        return known
    ratios, wrongs, errors = zip(*failing, strict=True)
    there = 0
    for check in checks:
        there |= int((check.cells or NO_CELLS)[1], 16)
    return msgspec.structs.replace(
        known,
        ratio=_closer(known.ratio, ratios),
        error=_closer(known.error, errors),
        wrong=_fewer(known, wrongs),
        cells=None if known.cells is None else f"{int(known.cells, 16) & there:016x}",
    )


def _closer(known: Bound | Bounds, values: Sequence[float]) -> Bound | Bounds:
    """Return a number, or a range, that allows no more than `known` does, and is as low as the values are."""
    if not isinstance(known, tuple) and min(values) == max(values):
        return known if values[0] >= float(known) else _rounded(values[0])
    low, high = range_of(known)
    least, most = _rounded(min(values) / (1 + SLACK)), _rounded(max(values) * (1 + SLACK))
    return min(low, least), min(high, max(most, least))


def _fewer(known: KnownCheck, wrongs: Sequence[int]) -> int | tuple[int, int]:
    if isinstance(known.wrong, int) and min(wrongs) == max(wrongs):
        return min(known.wrong, wrongs[0])
    low, high = known.pixels
    least, most = math.floor(min(wrongs) / (1 + SLACK)), math.ceil(max(wrongs) * (1 + SLACK))
    return min(low, least), min(high, max(most, least))


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
