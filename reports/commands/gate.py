"""`rayproof gate`: what is known to fail, for the gate of a CI job."""

from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Literal

from rayproof.reports.commands.lookup import Repeated
from rayproof.reports.commands.output import say, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line

SHUT = 1  # exit code of `check` where the gate stays shut


def gate(
    what: Literal["accept", "prune", "check"],
    folder: Path,
    *,
    file: Path = Path("expectations.json"),
    reason: str | None = None,
    expires: str | None = None,
    issue: str | None = None,
    when: Repeated = (),
    against: Path | None = None,
    least_coverage: float | None = None,
    json: Path | None = None,
) -> int:
    """Keep a file of known failures for `rayproof run --expect FILE`, which is green only while exactly these occur.

    Parameters
    ----------
    what
        accept: add an entry for each failing check without one; needs --reason. prune: remove entries whose checks
        pass, and narrow the others; nothing is added or widened. check: check the run against the file, as `rayproof
        run --expect` does, and exit with 1 if the gate is red.
    folder
        A folder that `rayproof run --out` filled.
    file
        The file of known failures.
    reason
        With accept: why these checks fail.
    expires
        With accept: the last day on which the new entries hold, such as 2027-01-31.
    issue
        With accept: a link to the issue.
    when
        With accept: a condition of the new entries, KEY=PATTERN, where KEY is `subject` or a key of the run's
        environment such as `backend`. Repeatable.
    against
        With check: an earlier run's folder, or a history file; what became worse is red too.
    least_coverage
        With check: the least share [%] of the checks that must be measured.
    json
        Also write the result to this file.

    """
    from rayproof.reports.history.expectations import load_expectations, save_expectations
    from rayproof.reports.results.document import load_results

    if what != "accept" and (reason is not None or expires is not None or issue is not None or when):
        raise UsageError("--reason, --expires, --issue and --when apply to accept only")
    if what != "check" and (against is not None or least_coverage is not None):
        raise UsageError("--against and --least-coverage apply to check only")
    with told_in_one_line():
        results = load_results(folder)
        known = () if what == "accept" and not file.exists() else load_expectations(file)
    suite = f"rayproof {results.get('rayproof', '')}".strip()
    if what == "check":
        from rayproof.reports.history.gating import SHUTTING, Demanded, held, load_base

        with told_in_one_line():
            base = None if against is None else load_base(against)
        demanded = Demanded(expected=(str(file), known), against=base, least_coverage=least_coverage)
        found = held(results, demanded)
        for key in SHUTTING:
            for sentence in getattr(found, key):
                say(f"{key}: {sentence}")
        say(found.sentence)
        write_json(json, found.record())
        return SHUT if found.red else 0
    if what == "prune":
        from rayproof.reports.history.gating import pruned

        kept, done = pruned(results, known)
        _written(lambda: save_expectations(file, kept, suite))
        for sentence in done:
            say(sentence)
        say(f"{len(kept)} of {len(known)} entries stay in {file}")
        write_json(json, {"file": str(file), "entries": len(kept), "done": done})
        return 0
    if reason is None or not reason.strip():
        raise UsageError("accept needs --reason, which says why these checks fail")
    from rayproof.reports.history.gating import accepted

    with told_in_one_line():
        if expires is not None:
            date.fromisoformat(expires)
        conditions = dict(_condition(text) for text in when)
    entries, new = accepted(results, known, reason=reason, expires=expires, issue=issue, when=conditions)
    _written(lambda: save_expectations(file, entries, suite))
    say(f"{new} failing checks accepted; {len(entries)} entries in {file}")
    write_json(json, {"file": str(file), "entries": len(entries), "accepted": new})
    return 0


def _condition(text: str) -> tuple[str, str]:
    key, equals, pattern = text.partition("=")
    if not key or not equals:
        raise ValueError(f"--when must be KEY=PATTERN, such as backend=llvm, got {text!r}")
    return key, pattern


def _written(write: Callable[[], None]) -> None:
    with told_in_one_line():
        write()
