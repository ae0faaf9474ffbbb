"""`rayproof gate`: accept or prune known failures, or check a run against them."""

from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from msgspec import structs

from rayproof.reports.commands.lookup import Repeated
from rayproof.reports.commands.output import say, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line
from rayproof.reports.results.files import several

SHUT = 1  # exit code of `check` where the gate is red
MOST = 8  # lines that are printed of a list: ten with those that count the rest and sum up


def gate(
    what: Literal["accept", "prune", "check"],
    folder: Path,
    *,
    file: Path = Path("known.json"),
    patterns: Annotated[bool, Parameter(name="--any")] = False,
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
        accept: add the failing checks that no entry is about, which needs --reason, and write how many checks are
        answered. prune: remove checks that pass, and narrow the others; nothing is added or widened. check: check the
        run against the file, as `rayproof run --expect` does, and exit with 1 if the gate is red.
    folder
        A folder that `rayproof run --out` filled.
    file
        The file of known failures.
    patterns
        Let entries of the file name cases and checks by patterns, such as shadows/*, or leave out where pixels are
        wrong. Without it such a file is refused.
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
        With check: the least share [%] of the cases that must be answered.
    json
        Also write the result to this file.

    """
    from rayproof.reports.history.expectations import Known, load_known, save_known
    from rayproof.reports.results.document import load_results

    if what != "accept" and (reason is not None or expires is not None or issue is not None or when):
        raise UsageError("--reason, --expires, --issue and --when apply to accept only")
    if what != "check" and (against is not None or least_coverage is not None):
        raise UsageError("--against and --least-coverage apply to check only")
    with told_in_one_line():
        results = load_results(folder)
        known = Known() if what == "accept" and not file.exists() else load_known(file, patterns=patterns)
    known = structs.replace(known, suite=f"rayproof {results.get('rayproof', '')}".strip())
    if what == "check":
        from rayproof.reports.history.gating import Demanded, held, load_base
        from rayproof.reports.results.records import SHUTTING

        with told_in_one_line():
            base = None if against is None else load_base(against)
        demanded = Demanded(expected=(str(file), known), against=base, least_coverage=least_coverage)
        found = held(results, demanded)
        _listed([f"{key}: {sentence}" for key in SHUTTING for sentence in getattr(found, key)])
        say(found.sentence)
        write_json(json, found.record())
        return SHUT if found.red else 0
    if what == "prune":
        from rayproof.reports.history.gating import pruned

        left, done = pruned(results, known)
        with told_in_one_line():
            save_known(file, left)
        _listed(done)
        say(f"{len(left.expected)} of the {len(known.expected)} in {file} stay")
        write_json(json, {"file": str(file), "entries": len(left.expected), "done": done})
        return 0
    from rayproof.reports.history.gating import accepted

    with told_in_one_line():
        if expires is not None:
            date.fromisoformat(expires)
        conditions = dict(_condition(text) for text in when)
    more, new, refused = accepted(results, known, reason=reason or "", expires=expires, issue=issue, when=conditions)
    if new and (reason is None or not reason.strip()):
        raise UsageError(f"accept needs --reason, which says why these {new} checks fail")
    with told_in_one_line():
        save_known(file, more)
    _listed([f"not accepted: {sentence}" for sentence in refused])
    entries = f"{(n := len(more.expected))} {'entry' if n == 1 else 'entries'}"
    say(f"{several(new, 'failing check')} accepted; {entries} in {file}")
    write_json(json, {"file": str(file), "entries": len(more.expected), "accepted": new, "refused": refused})
    return 0


def _listed(lines: Sequence[str]) -> None:
    """Print the first lines, and how many more there are."""
    for line in lines[:MOST]:
        say(line)
    if len(lines) > MOST:
        say(f"and {len(lines) - MOST} more; --json FILE writes them all")


def _condition(text: str) -> tuple[str, str]:
    key, equals, pattern = text.partition("=")
    if not key or not equals:
        raise ValueError(f"--when must be KEY=PATTERN, such as backend=llvm, got {text!r}")
    return key, pattern
