"""The gate: a run is compared with known failures and earlier runs; accepting and pruning expectations."""

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
LEAST_OF_BEFORE = 0.99  # of the share of the checks that were answered when the failures were accepted
SHOW_NOTHING = (Outcome.ERROR, Outcome.MISSING, Outcome.UNDECIDED, Outcome.UNSUPPORTED)


@dataclass(frozen=True, kw_only=True)
class Base:
    """The base of a comparison: the results of an earlier run, or a file with a history."""

    name: str  # the path as the user wrote it
    results: RunRecord | None  # None: a history


def load_base(path: Path) -> Base:
    """Return the run in a folder, or the history in a file.

    Raises:
        OSError, ValueError: it is neither; the message names the file.

    """
    if path.is_dir():
        return Base(name=str(path), results=load_results(path))
    with opened(path):
        pass  # the file is a history and can be read
    return Base(name=str(path), results=None)


@dataclass(kw_only=True)
class GateResult:
    """The result: each list has a sentence for each case or entry, which begins with its name."""

    file: str  # the bases of the comparison, in words
    regressions: list[str] = field(default_factory=list)  # cases that fail unexpectedly, or unlike the expectation
    tighten: list[str] = field(default_factory=list)  # cases that fail less than expected, or no longer
    stale: list[str] = field(default_factory=list)  # entries about planned cases that match no check of the run
    expired: list[str] = field(default_factory=list)  # entries about planned cases whose last day is over
    worse: list[str] = field(default_factory=list)  # cases that are worse than in the base run or history
    uncovered: list[str] = field(default_factory=list)  # shares of measured or answered checks that are too low
    matched: list[str] = field(default_factory=list)  # cases with checks that fail as expected or as before, and why
    cases: list[str] = field(default_factory=list)  # names of cases whose failures are all expected, or as before
    mended: list[str] = field(default_factory=list)  # cases that failed in the base run, and pass

    @property
    def red(self) -> bool:
        """Return whether the gate fails the run."""
        return any(getattr(self, kind) for kind in SHUTTING)

    @property
    def sentence(self) -> str:
        """Return the result in one sentence."""
        counts = ", ".join(gate_counts(cast(GateRecord, asdict(self)))) or "nothing fails"
        return f"The gate {self.file} is {'red' if self.red else 'green'}: {counts}."

    def record(self) -> GateRecord:
        """Return the result as a record of results.json."""
        return cast(GateRecord, {"sentence": self.sentence, "red": self.red, **asdict(self)})


def standing(results: RunRecord, base: Base) -> GateResult:
    """Return the cases that became worse since `base`, and those whose failures are as before."""
    return _before_history(results, base) if base.results is None else _before_run(results, base.name, base.results)


def _before_run(results: RunRecord, name: str, earlier: RunRecord) -> GateResult:
    earlier_cases = {case["name"]: case for case in earlier["cases"]}
    pairs = paired(
        *([str(configuration) for configuration in run.get("configurations", ())] for run in (earlier, results))
    )
    worse_cases, same, cases, mended = [], [], [], []
    for case in results["cases"]:
        before = earlier_cases.get(case["name"])
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
        worse_cases += _for_a_case(case["name"], worsened)
        same += _for_a_case(case["name"], kept)
        if case["verdict"] not in GOOD and not worsened:
            cases.append(case["name"])
    return GateResult(file=name, worse=worse_cases, matched=same, cases=cases, mended=mended)


def _for_a_case(name: str, sentences: Sequence[str]) -> list[str]:
    """Return a list of one sentence, the first of a case's checks and the number of others; empty without sentences."""
    more = f" (and {len(sentences) - 1} more of its checks)" if len(sentences) > 1 else ""
    return [f"{name}: {sentences[0]}{more}"] if sentences else []


def _worse(before: Check | None, after: Check | None) -> str | None:
    """Return a description of how a check became worse, or None."""
    if after is None:
        return f"was {before.outcome}, and is not made any more" if before is not None else None
    now = after.outcome
    if before is None:
        return f"{now}, and was not made before" if now not in GOOD else None
    was = before.outcome
    # An outcome without a measurement is no better than a failure.
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
    """Return a description of the number of cells with wrong pixels outside the `allowed` cells, or None."""
    cells = int((check.cells or NO_CELLS)[0], 16) & ~int(allowed, 16)
    return f"{cells.bit_count()} of 64 parts of the image in which they were right" if cells else None


def _before_history(results: RunRecord, base: Base) -> GateResult:
    """Compare a run with a history; it is appended to a copy, since only `--history` writes the file itself."""
    with tempfile.TemporaryDirectory(prefix="rayproof-against-") as folder:
        copy = Path(folder, "history.sqlite")
        shutil.copyfile(base.name, copy)
        run = append(copy, results, revision())
        with opened(copy) as connection:
            worse_series = worse(read_series(connection, str(results.get("subject", "tracer"))), run)
    named = {entry["case"] for entry in worse_series}
    cases = [case["name"] for case in results["cases"] if case["verdict"] not in GOOD and case["name"] not in named]
    return GateResult(
        file=base.name,
        worse=[entry["sentence"] for entry in worse_series],
        matched=[f"{name}: fails, and is no worse than in {base.name}" for name in cases],
        cases=cases,
    )


# Compare a finished run with the user's conditions.


@dataclass(frozen=True, kw_only=True)
class Demanded:
    """The conditions that a user sets for a run; by default there are none."""

    expected: tuple[str, KnownFailures] | None = None  # the file of known failures: its name and its content
    against: Base | None = None  # no case may be worse than in this run or history
    least_coverage: float | None = None  # %, of the cases that must be answered

    @property
    def lets_through(self) -> bool:
        """Return whether the conditions allow some failures."""
        return self.expected is not None or self.against is not None


def held(results: RunRecord, demanded: Demanded, *, today: date | None = None) -> GateResult:
    """Compare a run's record (`results.json`) with the user's conditions."""
    file, failures = demanded.expected or ("", KnownFailures())
    names = [file] if demanded.expected else []
    names += [f"against {demanded.against.name}"] if demanded.against else []
    names += [f"of at least {demanded.least_coverage:g} % coverage"] if demanded.least_coverage is not None else []
    called = ", ".join(names)
    if demanded.expected is not None or demanded.against is None:
        result = gate(results, failures, file=called, today=today)
    else:
        result = GateResult(file=called)
        _hold_the_whole(results, result)
    if demanded.against is not None:
        comparison = standing(results, demanded.against)
        result.worse, result.mended = comparison.worse, comparison.mended
        if demanded.expected is None:
            result.matched, result.cases = comparison.matched, comparison.cases
    if demanded.least_coverage is not None:
        share, sentence = coverage(results)
        if not share >= demanded.least_coverage:
            result.uncovered.append(f"{sentence}, and {demanded.least_coverage:g} % are demanded")
    return result


def coverage(results: RunRecord) -> tuple[float, str]:
    """Return the share [%] of the cases that were answered (0 if none was planned), and a sentence about it."""
    answered = results.get("answered") or {}
    cases, planned = answered.get("cases", 0), answered.get("planned_cases", 0)
    share = 100 * cases / planned if planned else 0.0
    return share, f"{cases} of {several(planned, 'case')} ({share:.1f} %) were answered"


def gate(results: RunRecord, failures: KnownFailures, *, file: str, today: date | None = None) -> GateResult:
    """Compare a run's record (`results.json`) with a file of known failures.

    Only entries about planned cases count, so that the shards of a suite can share a file.
    """
    today = today or date.today()
    result = GateResult(file=file)
    valid: list[Expectation] = []
    for entry in failures.expected:
        if not any(entry.about_case(case["name"]) for case in results["cases"]) or not entry.holds_for(results):
            continue
        if entry.expired(today):
            result.expired.append(f"{entry.name}: expired on {entry.expires}: {entry.reason}")
        else:
            valid.append(entry)
    outcomes_by_check: dict[tuple[int, str], list[str]] = {
        (k, name): [] for k, entry in enumerate(valid) for name in entry.checks
    }
    for case in results["cases"]:
        _hold_case(case, valid, outcomes_by_check, result)
    for place, entry in enumerate(valid):
        verdicts = {name: outcomes_by_check[place, name] for name in entry.checks}
        gone = [f"no check of the run is called {name}" for name in verdicts if not verdicts[name]]
        right = [
            name for name, outcomes in verdicts.items() if outcomes and all(verdict in RIGHT for verdict in outcomes)
        ]
        silent = {
            name: outcomes
            for name, outcomes in verdicts.items()
            if outcomes and {*outcomes} <= {*GOOD} and {*outcomes} - {*RIGHT}
        }
        result.stale += _for_a_case(entry.name, gone)
        result.tighten += _for_a_case(entry.name, [f"{name} passes now, and is expected to fail" for name in right])
        why = [
            f"{name} is {outcomes[0]}, which does not show whether it still fails" for name, outcomes in silent.items()
        ]
        result.regressions += _for_a_case(entry.name, why)
    _hold_the_whole(results, result)
    result.uncovered += _answers_less(results, failures)
    return result


def _answers_less(results: RunRecord, failures: KnownFailures) -> list[str]:
    """Return a sentence for each family with fewer answered checks, as a share, than when failures were accepted."""
    sentences = []
    for family, (done, planned) in (results.get("answered") or {}).get("families", {}).items():
        before, of = failures.answered.get(family, (0, 0))
        # Both shares times both numbers of checks: integers, without rounding.
        if done * of < LEAST_OF_BEFORE * before * planned:
            was = f"{100 * before / of:.4g} %"
            sentences.append(
                f"{family}: {done} of {planned} checks ({100 * done / planned:.4g} %) are answered, {was} were"
            )
    return sentences


def _hold_the_whole(results: RunRecord, result: GateResult) -> None:
    result.regressions += [f"the whole run: {sentence}" for sentence in of_the_whole(results)]
    if not results.get("finished", False):
        result.regressions.append("the whole run: it is not finished, so that not all is known")


def _hold_case(
    case: CaseRecord, valid: Sequence[Expectation], outcomes: dict[tuple[int, str], list[str]], result: GateResult
) -> None:
    """Compare the checks of a case with the entries about them, and add the sentences to `result`."""
    reasons: dict[str, int] = {}  # the number of checks per reason of a matching entry
    wrong: dict[str, list[str]] = {"regressions": [], "tighten": []}
    entries = [(place, entry) for place, entry in enumerate(valid) if entry.about_case(case["name"])]
    for check in case["checks"] if entries or case["verdict"] not in RIGHT else ():
        about = [(entry, name, place) for place, entry in entries if (name := entry.about(case["name"], check))]
        for _, name, place in about:
            outcomes[place, name].append(check.outcome)
        if check.outcome in GOOD:
            continue
        where = check.name
        if not about:
            wrong["regressions"].append(f"{where}: {check.outcome}, and no entry is about it")
            continue
        # A check about which there are several entries needs to match only one.
        objections = [_objection(case, check, entry, entry.checks[name]) for entry, name, _ in about]
        if None in objections:
            entry = about[objections.index(None)][0]
            reasons[entry.reason] = reasons.get(entry.reason, 0) + 1
            continue
        kind, why = min(filter(None, objections), key=lambda objection: objection[0] != "tighten")
        wrong[kind].append(f"{where}: {why}")
    # A failed closed form fails the case but has no check of its own, so that no entry can be about it.
    closed = [
        expectation["verdict"]
        for expectation in case.get("expectations") or ()
        if expectation.get("verdict") not in (None, *GOOD)
    ]
    wrong["regressions"] += [f"{verdict} of its expectations, of which no entry can be" for verdict in closed]
    if not any([reasons, *wrong.values()]) and case["verdict"] not in GOOD:
        wrong["regressions"].append(f"{case['verdict']}: {case.get('reason') or 'no check says why'}")
    result.regressions += _for_a_case(case["name"], wrong["regressions"])
    result.tighten += _for_a_case(case["name"], wrong["tighten"])
    result.matched += [f"{case['name']}: {several(n, 'failing check')}: {reason}" for reason, n in reasons.items()]
    if reasons and not any(wrong.values()):
        result.cases.append(case["name"])


def _objection(case: CaseRecord, check: Check, entry: Expectation, expected: KnownCheck) -> tuple[str, str] | None:
    """Return how a failing check differs from its entry, as (list of `GateResult`, description); None if it matches."""
    if (why := unexpectable(check)) is not None:
        return "regressions", why
    if check.outcome != expected.verdict:
        return "regressions", f"{check.outcome}, and {expected.verdict} is expected"
    if entry.item is not None and entry.item not in (case.get("blamed_items") or [case.get("item")]):
        return "regressions", f"{blamed_items(case) or 'nothing'} is blamed, and {entry.item} is expected"
    for what, value, (low, high) in zip(FIGURES, figures(check), expected.ranges, strict=True):
        if not value <= high:
            return "regressions", f"{value:.4g} {what}, and at most {high:.4g} is expected"
        if value < low:
            return "tighten", f"{value:.4g} {what}, and at least {low:.4g} is expected"
    strays = None if expected.cells is None else _elsewhere(check, expected.cells)
    return None if strays is None else ("regressions", f"pixels are wrong in {strays}")


def unexpectable(check: Check) -> str | None:
    """Return the reason why no entry can be about a failing check, or None."""
    if check.outcome not in EXPECTABLE:
        return f"{check.outcome}, where nothing can be expected of it: {check.reason}"
    count = not_finite(check)
    if count or math.isnan(figures(check)[0]):
        return f"{count} pixels without a finite number, of which nothing can be expected"
    return None


FIGURES = ("error over limit", "wrong pixels", "mean error of the wrong pixels")


def figures(check: Check) -> tuple[float, int, float]:
    """Return a check's worst error over its limit, the number of wrong pixels, and their mean error."""
    means = [measured.mean_wrong for measured in (check.end_to_end, check.continued) if measured is not None]
    wrong = check.examined.wrong if check.examined else 0
    return check.ratio, wrong, next(filter(None, means), 0.0)


def not_finite(check: Check) -> int:
    """Return the number of pixels of the subject with NaN, or with an infinity that is no miss."""
    measured = [measurement for measurement in (check.end_to_end, check.continued) if measurement is not None]
    return max(
        (measurement.nan + (measurement.inf if check.stage is not Stage.DISTANCE else 0) for measurement in measured),
        default=0,
    )


# Add failing checks to a file of known failures, and remove checks that pass again.


@dataclass(frozen=True, kw_only=True)
class Acceptance:
    """The failures to accept, and the reason; by default every failing check."""

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


def accepted(
    results: RunRecord, failures: KnownFailures, acceptance: Acceptance
) -> tuple[KnownFailures, int, list[str]]:
    """Return the file with the failing checks added that have no entry, their number, and the refused checks.

    The new file also contains the number of answered checks of each family. Checks of a case with the same item, reason
    and conditions are one expectation.
    """
    expectations = list(failures.expected)
    count, refused = 0, []
    for case in filter(acceptance.covers, results["cases"]):
        about = [entry for entry in failures.expected if entry.about_case(case["name"]) and entry.holds_for(results)]
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
    answered = {**failures.answered, **(results.get("answered") or {}).get("families", {})}
    return msgspec.structs.replace(failures, expected=expectations, answered=answered), count, refused


def _only_cause(case: CaseRecord) -> str | None:
    """Return the name of the mistake that explains a case's failure; None if there is none, or more than one."""
    names = case.get("cause") or ()
    return names[0] if len(names) == 1 else None


def pruned(results: RunRecord, failures: KnownFailures) -> tuple[KnownFailures, list[str]]:
    """Return the file without checks that pass or are gone, the others narrowed, and a sentence for each changed entry.

    The file only shrinks: no entry is added, and none becomes wider. Entries about cases or checks that were not run or
    not measured stay unchanged.
    """
    kept, done = [], []
    for entry in failures.expected:
        cases = [case for case in results["cases"] if entry.about_case(case["name"])]
        if not cases or not entry.holds_for(results):
            kept.append(entry)
            continue
        checks_by_name: dict[str, list[Check]] = {name: [] for name in entry.checks}
        for case in cases:
            for check in case["checks"]:
                if (name := entry.about(case["name"], check)) is not None:
                    checks_by_name[name].append(check)
        left = {
            name: _narrowed(entry.checks[name], checks) for name, checks in checks_by_name.items() if not _over(checks)
        }
        narrowed = sum(check != entry.checks[name] for name, check in left.items())
        counts = ((len(entry.checks) - len(left), "pass now or are gone"), (narrowed, "fail less and are narrowed"))
        if words := ", ".join(f"{count} {what}" for count, what in counts if count):
            done.append(f"{entry.name}: of {len(entry.checks)} checks {words}")
        if left:
            kept.append(msgspec.structs.replace(entry, checks=left))
    return msgspec.structs.replace(failures, expected=kept), done


def _over(checks: Sequence[Check]) -> bool:
    """Return whether an entry no longer applies to `checks`: all of them pass, or there are none."""
    return all(check.outcome in RIGHT for check in checks)


def _narrowed(expected: KnownCheck, checks: Sequence[Check]) -> KnownCheck:
    """Return the entry of some checks with its ranges narrowed to their figures; no upper end rises.

    The lower ends are at most the checks' smallest figures, so that a range may begin lower than before.
    """
    failing = [figures(check) for check in checks if check.outcome in EXPECTABLE]
    if not failing:
        return expected
    ratios, wrongs, errors = zip(*failing, strict=True)
    cells = 0
    for check in checks:
        cells |= int((check.cells or NO_CELLS)[1], 16)
    return msgspec.structs.replace(
        expected,
        ratio=_closer(expected.ratio, ratios),
        error=_closer(expected.error, errors),
        wrong=_fewer(expected, wrongs),
        cells=None if expected.cells is None else f"{int(expected.cells, 16) & cells:016x}",
    )


def _closer(expected: Bound | Bounds, values: Sequence[float]) -> Bound | Bounds:
    """Return a number or a range that contains the values as far as `expected` allows them, with no higher end."""
    if not isinstance(expected, tuple) and min(values) == max(values):
        return expected if values[0] >= float(expected) else _rounded(values[0])
    low, high = range_of(expected)
    least, most = _rounded(min(values) / (1 + SLACK)), _rounded(max(values) * (1 + SLACK))
    return min(low, least), min(high, max(most, least))


def _fewer(expected: KnownCheck, wrongs: Sequence[int]) -> int | tuple[int, int]:
    if isinstance(expected.wrong, int) and min(wrongs) == max(wrongs):
        return min(expected.wrong, wrongs[0])
    low, high = expected.pixels
    least, most = math.floor(min(wrongs) / (1 + SLACK)), math.ceil(max(wrongs) * (1 + SLACK))
    return min(low, least), min(high, max(most, least))


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
