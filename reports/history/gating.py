"""The gate, which compares a run with known failures and earlier runs; also accepts and prunes expectations."""

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
    Known,
    KnownCheck,
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
LEAST_OF_BEFORE = 0.99  # the share of answered checks may fall to this factor of the share at acceptance
SHOW_NOTHING = (Outcome.ERROR, Outcome.MISSING, Outcome.UNDECIDED, Outcome.UNSUPPORTED)


@dataclass(frozen=True, kw_only=True)
class Base:
    """The base of a comparison: the results of an earlier run, or a file with a history."""

    name: str  # the path as the user wrote it
    results: RunRecord | None  # None for a history


def load_base(path: Path) -> Base:
    """Return the run in a folder, or the history in a file.

    Raises:
        OSError, ValueError: the path is neither; the message names the file.

    """
    if path.is_dir():
        return Base(name=str(path), results=load_results(path))
    with opened(path):
        pass  # the file is a history and can be read
    return Base(name=str(path), results=None)


@dataclass(frozen=True, kw_only=True)
class Standing:
    """The comparison of a run with an earlier one, in sentences that begin with the name of a case."""

    worse: list[str]
    as_before: list[str]  # failures that did not become worse
    cases: list[str]  # names of failing cases without a change for the worse
    mended: list[str] = field(default_factory=list)  # cases that failed before and pass now


def standing(results: RunRecord, base: Base) -> Standing:
    """Return the changes of a run since `base`: failures that became worse, and failures that did not."""
    return _before_history(results, base) if base.results is None else _before_run(results, base.name, base.results)


def _before_run(results: RunRecord, name: str, earlier: RunRecord) -> Standing:
    earlier_cases = {case["name"]: case for case in earlier["cases"]}
    pairs = paired(*([str(name) for name in run.get("configurations", ())] for run in (earlier, results)))
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
    return Standing(worse=worse_cases, as_before=same, cases=cases, mended=mended)


def _for_a_case(name: str, sentences: Sequence[str]) -> list[str]:
    """Return a list with the first sentence and the number of further ones; an empty list without sentences."""
    more = f" (and {len(sentences) - 1} more of its checks)" if len(sentences) > 1 else ""
    return [f"{name}: {sentences[0]}{more}"] if sentences else []


def _worse(before: Check | None, after: Check | None) -> str | None:
    """Return a phrase that describes how a check became worse, or None."""
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
    """Return a phrase with the number of cells that contain wrong pixels but are not `allowed` to, or None."""
    cells = int((check.cells or NO_CELLS)[0], 16) & ~int(allowed, 16)
    return f"{cells.bit_count()} of 64 parts of the image in which they were right" if cells else None


def _before_history(results: RunRecord, base: Base) -> Standing:
    """Return the comparison of a run with a history.

    The run is appended to a copy of the history, since only `--history` writes to the file itself.
    """
    with tempfile.TemporaryDirectory(prefix="rayproof-against-") as folder:
        copy = Path(folder, "history.sqlite")
        shutil.copyfile(base.name, copy)
        run = append(copy, results, revision())
        with opened(copy) as connection:
            records = worse(read_series(connection, str(results.get("subject", "tracer"))), run)
    named = {entry["case"] for entry in records}
    cases = [case["name"] for case in results["cases"] if case["verdict"] not in GOOD and case["name"] not in named]
    return Standing(
        worse=[entry["sentence"] for entry in records],
        as_before=[f"{name}: fails, and is no worse than in {base.name}" for name in cases],
        cases=cases,
    )


# The comparison of a finished run with the expectations.


@dataclass(kw_only=True)
class Gate:
    """The result of the gate; each list contains a sentence per case or entry, which begins with its name."""

    file: str  # the names of the file, run or history that the gate compares with
    regressions: list[str] = field(default_factory=list)  # unexpected failures, or failures that differ from the entry
    tighten: list[str] = field(default_factory=list)  # checks that fail less than expected, or pass
    stale: list[str] = field(default_factory=list)  # entries for planned cases that match no check
    expired: list[str] = field(default_factory=list)  # entries for planned cases whose last valid day is over
    worse: list[str] = field(default_factory=list)  # changes for the worse since the earlier run or the history
    uncovered: list[str] = field(default_factory=list)  # sentences on too few measured or answered checks
    matched: list[str] = field(default_factory=list)  # cases with checks that fail as expected, and the entry's reason
    cases: list[str] = field(default_factory=list)  # names of cases whose failures are all expected
    mended: list[str] = field(default_factory=list)  # cases that failed in the earlier run and pass now

    @property
    def red(self) -> bool:
        """Return whether the gate is red, so that the exit code is 1."""
        return any(getattr(self, kind) for kind in SHUTTING)

    @property
    def sentence(self) -> str:
        """Return the result in one sentence."""
        counts = ", ".join(gate_counts(cast(GateRecord, asdict(self)))) or "nothing fails"
        return f"The gate {self.file} is {'red' if self.red else 'green'}: {counts}."

    def record(self) -> GateRecord:
        """Return the record for results.json."""
        return cast(GateRecord, {"sentence": self.sentence, "red": self.red, **asdict(self)})


@dataclass(frozen=True, kw_only=True)
class Demanded:
    """The conditions that a user sets for a run; by default there are none."""

    expected: tuple[str, Known] | None = None  # the name of the file of known failures, and its content
    against: Base | None = None  # the base of the comparison; nothing may be worse than there
    least_coverage: float | None = None  # share of the cases that must be answered [%]

    @property
    def lets_through(self) -> bool:
        """Return whether the gate may be green although checks fail."""
        return self.expected is not None or self.against is not None


def held(results: RunRecord, demanded: Demanded, *, today: date | None = None) -> Gate:
    """Compare a run's record (`results.json`) with the demanded conditions, and return the result."""
    file, known_failures = demanded.expected or ("", Known())
    names = [file] if demanded.expected else []
    names += [f"against {demanded.against.name}"] if demanded.against else []
    names += [f"of at least {demanded.least_coverage:g} % coverage"] if demanded.least_coverage is not None else []
    called = ", ".join(names)
    if demanded.expected is not None or demanded.against is None:
        result = gate(results, known_failures, file=called, today=today)
    else:
        result = Gate(file=called)
        _hold_the_whole(results, result)
    if demanded.against is not None:
        stands = standing(results, demanded.against)
        result.worse, result.mended = stands.worse, stands.mended
        if demanded.expected is None:
            result.matched, result.cases = stands.as_before, stands.cases
    if demanded.least_coverage is not None:
        share, sentence = coverage(results)
        if not share >= demanded.least_coverage:
            result.uncovered.append(f"{sentence}, and {demanded.least_coverage:g} % are demanded")
    return result


def coverage(results: RunRecord) -> tuple[float, str]:
    """Return the share [%] of answered cases, 0 if none was planned, and a phrase with the numbers."""
    answered = results.get("answered") or {}
    cases, planned = answered.get("cases", 0), answered.get("planned_cases", 0)
    share = 100 * cases / planned if planned else 0.0
    return share, f"{cases} of {several(planned, 'case')} ({share:.1f} %) were answered"


def gate(results: RunRecord, known_failures: Known, *, file: str, today: date | None = None) -> Gate:
    """Compare a run's record (`results.json`) with a file of known failures, and return the result.

    Only entries for planned cases count, so that the shards of a suite can share a file.
    """
    today = today or date.today()
    result = Gate(file=file)
    valid: list[Expectation] = []
    for entry in known_failures.expected:
        if not any(entry.about_case(case["name"]) for case in results["cases"]) or not entry.holds_for(results):
            continue
        if entry.expired(today):
            result.expired.append(f"{entry.name}: expired on {entry.expires}: {entry.reason}")
        else:
            valid.append(entry)
    outcomes: dict[tuple[int, str], list[str]] = {
        (k, name): [] for k, entry in enumerate(valid) for name in entry.checks
    }
    for case in results["cases"]:
        _hold_case(case, valid, outcomes, result)
    for place, entry in enumerate(valid):
        verdicts = {name: outcomes[place, name] for name in entry.checks}
        gone = [f"no check of the run is called {name}" for name in verdicts if not verdicts[name]]
        right = [name for name, values in verdicts.items() if values and all(verdict in RIGHT for verdict in values)]
        silent = {
            name: values
            for name, values in verdicts.items()
            if values and {*values} <= {*GOOD} and {*values} - {*RIGHT}
        }
        result.stale += _for_a_case(entry.name, gone)
        result.tighten += _for_a_case(entry.name, [f"{name} passes now, and is expected to fail" for name in right])
        why = [f"{name} is {values[0]}, which does not show whether it still fails" for name, values in silent.items()]
        result.regressions += _for_a_case(entry.name, why)
    _hold_the_whole(results, result)
    result.uncovered += _answers_less(results, known_failures)
    return result


def _answers_less(results: RunRecord, known_failures: Known) -> list[str]:
    """Return a sentence for each family with a smaller share of answered checks than at acceptance."""
    sentences = []
    for family, (done, planned) in (results.get("answered") or {}).get("families", {}).items():
        before, of = known_failures.answered.get(family, (0, 0))
        # Multiplied by both numbers of checks, which avoids the rounding of a division.
        if done * of < LEAST_OF_BEFORE * before * planned:
            was = f"{100 * before / of:.4g} %"
            sentences.append(
                f"{family}: {done} of {planned} checks ({100 * done / planned:.4g} %) are answered, {was} were"
            )
    return sentences


def _hold_the_whole(results: RunRecord, result: Gate) -> None:
    result.regressions += [f"the whole run: {sentence}" for sentence in of_the_whole(results)]
    if not results.get("finished", False):
        result.regressions.append("the whole run: it is not finished, so that not all is known")


def _hold_case(
    case: CaseRecord, valid: Sequence[Expectation], outcomes: dict[tuple[int, str], list[str]], result: Gate
) -> None:
    """Compare the checks of one case with the entries that match them, and add the sentences to `result`."""
    matched: dict[str, int] = {}  # reason of an entry -> number of checks that fail as it expects
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
        # If several entries match a check, it is enough that the check agrees with one.
        objections = [_objection(case, check, entry, entry.checks[name]) for entry, name, _ in about]
        if None in objections:
            entry = about[objections.index(None)][0]
            matched[entry.reason] = matched.get(entry.reason, 0) + 1
            continue
        kind, why = min(filter(None, objections), key=lambda objection: objection[0] != "tighten")
        wrong[kind].append(f"{where}: {why}")
    # The comparison with a closed form fails a case without a check, so that no entry can match it.
    closed = [
        expectation["verdict"]
        for expectation in case.get("expectations") or ()
        if expectation.get("verdict") not in (None, *GOOD)
    ]
    wrong["regressions"] += [f"{verdict} of its expectations, of which no entry can be" for verdict in closed]
    if not any([matched, *wrong.values()]) and case["verdict"] not in GOOD:
        wrong["regressions"].append(f"{case['verdict']}: {case.get('reason') or 'no check says why'}")
    result.regressions += _for_a_case(case["name"], wrong["regressions"])
    result.tighten += _for_a_case(case["name"], wrong["tighten"])
    result.matched += [f"{case['name']}: {several(n, 'failing check')}: {reason}" for reason, n in matched.items()]
    if matched and not any(wrong.values()):
        result.cases.append(case["name"])


def _objection(case: CaseRecord, check: Check, entry: Expectation, expected: KnownCheck) -> tuple[str, str] | None:
    """Return the list of `Gate` and the phrase for a check that does not fail as the entry expects; None if it does."""
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
    """Return a phrase with the reason why a failing check cannot be expected, or None."""
    if check.outcome not in EXPECTABLE:
        return f"{check.outcome}, where nothing can be expected of it: {check.reason}"
    count = not_finite(check)
    if count or math.isnan(figures(check)[0]):
        return f"{count} pixels without a finite number, of which nothing can be expected"
    return None


FIGURES = ("error over limit", "wrong pixels", "mean error of the wrong pixels")


def figures(check: Check) -> tuple[float, int, float]:
    """Return a check's largest error over limit, the number of pixels over their limit, and their mean error."""
    means = [measured.mean_wrong for measured in (check.end_to_end, check.continued) if measured is not None]
    wrong = check.examined.wrong if check.examined else 0
    return check.ratio, wrong, next(filter(None, means), 0.0)


def not_finite(check: Check) -> int:
    """Return the number of pixels with NaN, or with an infinity that is no miss, in the subject's image."""
    measured = [measurement for measurement in (check.end_to_end, check.continued) if measurement is not None]
    return max(
        (measurement.nan + (measurement.inf if check.stage is not Stage.DISTANCE else 0) for measurement in measured),
        default=0,
    )


# The acceptance of failures into a file of known failures, and the removal of mended ones.


@dataclass(frozen=True, kw_only=True)
class Acceptance:
    """The failing checks to accept, by default all, and the reason."""

    reason: str
    cases: tuple[str, ...] = ()  # names of cases; empty for all
    cause: str | None = None  # name of a mistake; only cases that it explains are accepted
    expires: str | None = None
    issue: str | None = None
    when: Mapping[str, str] = field(default_factory=dict)

    def covers(self, case: CaseRecord) -> bool:
        """Return whether failing checks of a case are accepted."""
        if self.cause is not None and self.cause not in (case.get("cause") or ()):
            return False
        return not self.cases or case["name"] in self.cases


def accepted(results: RunRecord, known_failures: Known, acceptance: Acceptance) -> tuple[Known, int, list[str]]:
    """Add a run's failing checks that match no entry to the known failures.

    Return the new known failures, the number of added checks, and a sentence for each check that cannot be accepted.
    The numbers of answered checks per family are also updated. Checks of a case with the same item, reason and
    conditions become a single expectation.
    """
    expectations = list(known_failures.expected)
    count, refused = 0, []
    for case in filter(acceptance.covers, results["cases"]):
        about = [
            entry for entry in known_failures.expected if entry.about_case(case["name"]) and entry.holds_for(results)
        ]
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
    answered = {**known_failures.answered, **(results.get("answered") or {}).get("families", {})}
    return msgspec.structs.replace(known_failures, expected=expectations, answered=answered), count, refused


def _only_cause(case: CaseRecord) -> str | None:
    """Return the name of the mistake that explains a case's failure; None if there is no mistake or more than one."""
    names = case.get("cause") or ()
    return names[0] if len(names) == 1 else None


def pruned(results: RunRecord, known_failures: Known) -> tuple[Known, list[str]]:
    """Remove checks that pass or no longer exist from the known failures, and narrow the others to the run's failures.

    Return the new known failures, and a line for each changed entry. No entry is added or widened. Entries of cases or
    checks that were not run or not measured stay unchanged.
    """
    kept, done = [], []
    for entry in known_failures.expected:
        cases = [case for case in results["cases"] if entry.about_case(case["name"])]
        if not cases or not entry.holds_for(results):
            kept.append(entry)
            continue
        matched: dict[str, list[Check]] = {name: [] for name in entry.checks}
        for case in cases:
            for check in case["checks"]:
                if (name := entry.about(case["name"], check)) is not None:
                    matched[name].append(check)
        left = {name: _narrowed(entry.checks[name], checks) for name, checks in matched.items() if not _over(checks)}
        narrowed = sum(check != entry.checks[name] for name, check in left.items())
        counts = ((len(entry.checks) - len(left), "pass now or are gone"), (narrowed, "fail less and are narrowed"))
        if words := ", ".join(f"{count} {what}" for count, what in counts if count):
            done.append(f"{entry.name}: of {len(entry.checks)} checks {words}")
        if left:
            kept.append(msgspec.structs.replace(entry, checks=left))
    return msgspec.structs.replace(known_failures, expected=kept), done


def _over(checks: Sequence[Check]) -> bool:
    """Return whether the checks of an entry no longer fail: all pass, or there are none."""
    return all(check.outcome in RIGHT for check in checks)


def _narrowed(allowed: KnownCheck, checks: Sequence[Check]) -> KnownCheck:
    """Return a known failure narrowed to the failures of `checks`; its upper ends never rise.

    The lower ends may fall, so that all checks are still inside the ranges.
    """
    failing = [figures(check) for check in checks if check.outcome in EXPECTABLE]
    if not failing:
        return allowed
    ratios, wrongs, errors = zip(*failing, strict=True)
    there = 0
    for check in checks:
        there |= int((check.cells or NO_CELLS)[1], 16)
    return msgspec.structs.replace(
        allowed,
        ratio=_closer(allowed.ratio, ratios),
        error=_closer(allowed.error, errors),
        wrong=_fewer(allowed, wrongs),
        cells=None if allowed.cells is None else f"{int(allowed.cells, 16) & there:016x}",
    )


def _closer(allowed: Bound | Bounds, values: Sequence[float]) -> Bound | Bounds:
    """Return a bound or range that is no higher than `allowed`, and low enough for the values."""
    if not isinstance(allowed, tuple) and min(values) == max(values):
        return allowed if values[0] >= float(allowed) else _rounded(values[0])
    low, high = range_of(allowed)
    least, most = _rounded(min(values) / (1 + SLACK)), _rounded(max(values) * (1 + SLACK))
    return min(low, least), min(high, max(most, least))


def _fewer(allowed: KnownCheck, wrongs: Sequence[int]) -> int | tuple[int, int]:
    if isinstance(allowed.wrong, int) and min(wrongs) == max(wrongs):
        return min(allowed.wrong, wrongs[0])
    low, high = allowed.pixels
    least, most = math.floor(min(wrongs) / (1 + SLACK)), math.ceil(max(wrongs) * (1 + SLACK))
    return min(low, least), min(high, max(most, least))


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
