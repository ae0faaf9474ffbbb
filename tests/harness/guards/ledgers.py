"""The ledgers' guard: records whose counts, verdict and exit code are known."""

from collections.abc import Mapping

from rayproof.cases.stages import Stage
from rayproof.reports.results.case_records import CaseRecord, Check
from rayproof.reports.results.outcomes import Outcome, exit_code, worst
from rayproof.reports.run import totals
from tests.harness.guards import BrokenHarnessError


def guard_ledgers() -> None:
    """Count, sum up and conclude from known records; raise BrokenHarnessError where the answer is another."""
    passed = _record(Outcome.PASS, (Outcome.PASS,) * 2, planned=2)
    failed = _record(Outcome.FAIL, (Outcome.PASS, Outcome.FAIL, Outcome.FAIL), planned=3)
    both = totals.of([passed, failed])
    _expect(both.case_ledger(planned=3), {"pass": 1, "fail": 1, "missing": 1}, "of three cases")
    _expect(both.check_ledger(), {"pass": 3, "fail": 2, "missing": 0}, "of five checks")
    _refuses(_record(Outcome.PASS, (Outcome.PASS,) * 2, planned=3), "a lost check")
    _refuses(_record(Outcome.PASS, (Outcome.PASS,) * 3, planned=2), "a check counted twice")
    for outcome in Outcome:
        # What is undecided leaves the word to the rest, and is nobody's pass.
        wanted = Outcome.PASS if outcome is Outcome.UNDECIDED else outcome
        if worst([Outcome.PASS, outcome, Outcome.PASS]) is not wanted or worst([outcome]) is not outcome:
            raise BrokenHarnessError(f"the ledgers are broken: pass and {outcome} must make {wanted}")
        code = exit_code([Outcome.PASS, outcome])
        right = 0 if outcome in _GOOD else 1 if outcome in _WRONG else 3
        if code != right:
            raise BrokenHarnessError(f"the ledgers are broken: {outcome} must end in exit code {right}, got {code}")
    if exit_code([Outcome.UNDECIDED]) != 3:
        raise BrokenHarnessError("the ledgers are broken: a run that decided nothing must end in exit code 3")
    if worst([]) is not Outcome.MISSING or totals.of([passed]).verdict(planned=2) is not Outcome.MISSING:
        raise BrokenHarnessError("the ledgers are broken: what was not measured must be missing")


_GOOD = (Outcome.PASS, Outcome.WARN, Outcome.UNDECIDED)
_WRONG = (Outcome.FAIL, Outcome.REFERENCE_SUSPECT)


def _record(verdict: Outcome, checks: tuple[Outcome, ...], *, planned: int) -> CaseRecord:
    return {
        "name": "guard/ledger",
        "family": "guard",
        "verdict": verdict.value,
        "planned": planned,
        "covers": [],
        "ran": {},
        "checks": [Check(configuration="guard", reference="guard", stage=Stage.OBJECT, outcome=one) for one in checks],
    }


def _expect(counts: Mapping[str, object], wanted: dict[str, int], what: str) -> None:
    got = {name: counts[name] for name in wanted}
    if got != wanted:
        raise BrokenHarnessError(f"the ledgers are broken: the ledger {what} must read {wanted}, got {got}")


def _refuses(record: CaseRecord, what: str) -> None:
    try:
        totals.of([record]).check_ledger()
    except ValueError:
        return
    raise BrokenHarnessError(f"the ledgers are broken: {what} was not noticed")
